"""What surfaces beyond the first scatter by: their BRDF as it is baked, over its equivalent albedo.

    f(wi, wo) / d    in place of the 1/pi of    Ben-Artzi 2007, section 5.2.4

Pictures multiply by the albedo d of the edited material. Those of the materials as they are baked are thus exact, and
edits change the strength of what a further surface reflects, not its shape. Materials that are Lambertian keep 1/pi.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lambent.bake.keys import key_of
from lambent.core.arrays import Floats
from lambent.materials.factored.albedo import albedo, term_albedo
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.terms import Editable, Term
from lambent.scenes.scene import Scene

SIDES = ("reflection", "transmission")
OTHER = 0.01  # share of the albedo, in any channel, that a Lambertian material may scatter otherwise
BLACK = 0.01  # of the brightest channel: less has no shape of its own that paths would find
SCATTERING_TEXTURES = ("diffuse", "specular", "roughness", "normal", "direction")


def over_albedo(editable: Editable) -> Floats:
    """(2 sides, 2, 3) factors that make f / d of f: of each channel, and those of which channels without one get a sum.

    A channel that is black as baked has the shape of the brightest one: a first row of 0, and a second that is 0 but
    for that channel. A material with a black side has no shape there, and zeros throughout.
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
    """Whether all but `OTHER` of what a material scatters, to each side, is the same in all directions."""
    for side in editable.sides:
        mine = [term for term in editable.terms if (term.side == "transmission") == (side == "transmission")]
        each = np.array([term_albedo(term, editable.curves) for term in mine])
        shaped = np.array([not _is_even(editable, term) for term in mine])
        if (np.abs(each[shaped]).sum(axis=0) > OTHER * each.sum(axis=0)).any():
            return False
    return True


def _is_even(editable: Editable, term: Term) -> bool:
    """Whether f of a term is d / pi, at pairs of directions drawn at random."""
    rng = np.random.default_rng(0)
    z, phi = rng.uniform(0.02, 1, (2, 256)), rng.uniform(0, 2 * np.pi, (2, 256))
    wi, wo = np.stack([np.sqrt(1 - z**2) * np.cos(phi), np.sqrt(1 - z**2) * np.sin(phi), z], axis=-1)
    wi = wi * [1, 1, -1 if term.side == "transmission" else 1]
    even = term_albedo(term, editable.curves) / np.pi
    return bool(np.allclose(editable.eval_term(term, wi, wo), even, rtol=1e-3, atol=1e-9))


def state_of(editable: Editable) -> str:
    """A digest of all that a material scatters by, its name left out."""
    curves = [part for name in sorted(editable.curves) for part in (name, editable.curves[name].values)]
    return key_of("editable", 1, repr(editable.terms), *curves)


def unlike_documents(scene: Scene, editables: Mapping[str, Editable]) -> dict[str, Editable]:
    """Those that scatter otherwise than the scene's documents of these names."""
    documents = scene.materials
    return {
        name: one
        for name, one in editables.items()
        if name in documents and state_of(one) != state_of(of_material(documents[name]))
    }


def shapes_of(scene: Scene, editables: Mapping[str, Editable]) -> dict[str, Floats]:
    """`over_albedo` of the materials that have a shape: all but those that are Lambertian, or black."""
    found = {
        name: over_albedo(one) for name, one in editables.items() if is_textured(scene, name) or not is_lambertian(one)
    }
    return {name: factors for name, factors in found.items() if factors.any()}


def is_textured(scene: Scene, material: str) -> bool:
    """Whether a texture changes how a material scatters, from place to place."""
    textures = scene.textures.get(material)
    return textures is not None and any(getattr(textures, part) is not None for part in SCATTERING_TEXTURES)
