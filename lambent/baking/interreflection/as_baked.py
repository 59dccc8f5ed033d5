"""Scattering at surfaces beyond the first: the baked BRDF over its equivalent albedo.

    f(wi, wo) / d    in place of the 1/pi of    Ben-Artzi 2007, section 5.2.4

Pictures multiply by the albedo d of the edited material. With unedited materials they are therefore exact; edits change
the amount of light that a further surface reflects, not its shape. Lambertian materials keep 1/pi.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lambent.baking.running.keys import key_of
from lambent.core.arrays import Floats
from lambent.materials.factored.albedo import albedo, term_albedo
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.terms import Editable, Term
from lambent.scenes.scene import Scene

SIDES = ("reflection", "transmission")
OTHER = 0.01  # largest share of the albedo, in any channel, that a Lambertian material may scatter directionally
BLACK = 0.01  # relative to the brightest channel: darker channels have no shape that paths could find
SCATTERING_TEXTURES = ("diffuse", "specular", "roughness", "normal", "direction")


def over_albedo(editable: Editable) -> Floats:
    """(2 sides, 2, 3) factors that convert f to f / d: one per channel, then weights whose sum serves channels without.

    A channel that is black as baked takes the shape of the brightest one: its first row is 0, and the second is 0
    except for that channel. A material with a black side has no shape there, and zeros throughout.
    """
    found = np.zeros((2, 2, 3))
    for side in editable.sides:
        d = albedo(editable, side)
        if d.max() <= 0:
            return np.zeros((2, 2, 3))
        bright = d >= BLACK * d.max()
        found[SIDES.index(side), 0][bright] = 1 / d[bright]
        found[SIDES.index(side), 1, d.argmax()] = 1 / d.max()
    return found


def is_lambertian(editable: Editable) -> bool:
    """Whether a material scatters all light but the share `OTHER`, to each side, equally in all directions."""
    for side in editable.sides:
        mine = [term for term in editable.terms if (term.side == "transmission") == (side == "transmission")]
        each = np.array([term_albedo(term, editable.curves) for term in mine])
        shaped = np.array([not _is_even(editable, term) for term in mine])
        if (np.abs(each[shaped]).sum(axis=0) > OTHER * each.sum(axis=0)).any():
            return False
    return True


def _is_even(editable: Editable, term: Term) -> bool:
    """Whether f of a term is d / pi, tested at random pairs of directions."""
    rng = np.random.default_rng(0)
    z, phi = rng.uniform(0.02, 1, (2, 256)), rng.uniform(0, 2 * np.pi, (2, 256))
    wi, wo = np.stack([np.sqrt(1 - z**2) * np.cos(phi), np.sqrt(1 - z**2) * np.sin(phi), z], axis=-1)
    wi = wi * [1, 1, -1 if term.side == "transmission" else 1]
    even = term_albedo(term, editable.curves) / np.pi
    return bool(np.allclose(editable.eval_term(term, wi, wo), even, rtol=1e-3, atol=1e-9))


def state_of(editable: Editable) -> str:
    """A digest of all scattering properties of a material, without its name."""
    curves = [part for name in sorted(editable.curves) for part in (name, editable.curves[name].values)]
    return key_of("editable", 1, repr(editable.terms), *curves)


def unlike_documents(scene: Scene, editables: Mapping[str, Editable]) -> dict[str, Editable]:
    """Editables that scatter differently from the scene's documents of the same names."""
    documents = scene.materials
    return {
        name: one
        for name, one in editables.items()
        if name in documents and state_of(one) != state_of(of_material(documents[name]))
    }


def shapes_of(scene: Scene, editables: Mapping[str, Editable]) -> dict[str, Floats]:
    """`over_albedo` of the materials with a shape, that is, neither Lambertian nor black."""
    found = {
        name: over_albedo(one) for name, one in editables.items() if is_textured(scene, name) or not is_lambertian(one)
    }
    return {name: factors for name, factors in found.items() if factors.any()}


def is_textured(scene: Scene, material: str) -> bool:
    """Whether a texture changes a material's scattering from place to place."""
    textures = scene.textures.get(material)
    return textures is not None and any(getattr(textures, part) is not None for part in SCATTERING_TEXTURES)
