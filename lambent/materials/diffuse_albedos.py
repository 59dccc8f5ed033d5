"""Diffuse albedos of materials for light between surfaces, with equivalent albedos for edited lobes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lambent.core.answer import MOST_ALBEDO, Albedos
from lambent.core.arrays import Floats
from lambent.core.plain import Triple, triple
from lambent.materials.bsdf import specular_only
from lambent.materials.document import Material
from lambent.materials.factored.albedo import albedo
from lambent.materials.factored.of_lobes import of_material


def albedos_of(materials: Sequence[Material]) -> Albedos:
    """kd and kt_d of materials; light scattered by lobes is included in the rays instead."""
    shape = (len(materials), 3)
    return Albedos(
        np.array([m.kd for m in materials], float).reshape(shape),
        np.array([m.kt_d for m in materials], float).reshape(shape),
    )


def possible_kd(material: Material, kd: Triple) -> Triple:
    """A diffuse colour, reduced so that with the material's lobes and transmission no more than all light is scattered.

    A metal has less room for one than a wall.
    """
    lobes = lobe_albedo(material, "reflection") + lobe_albedo(material, "transmission")
    return triple(np.minimum(kd, np.maximum(1 - lobes - np.array(material.kt_d), 0)))


def edited_albedos(baked: Sequence[Material], edited: Sequence[Material]) -> Albedos:
    """Albedos of edited materials for rays that follow the lobes of the baked ones.

    The change of a lobe's light counts as diffuse: the difference of the equivalent albedos of the lobes (Ben-Artzi
    2007, section 5.2.4), per side, which can make an albedo negative. Albedos are clipped at MOST_ALBEDO, above which
    the series of bounces diverges.
    """
    found = albedos_of(edited)
    reflected, transmitted = found.reflected.copy(), found.transmitted.copy()
    for number, (before, after) in enumerate(zip(baked, edited, strict=True)):
        if before == after:
            continue
        if before.lobes != after.lobes:
            reflected[number] += lobe_albedo(after, "reflection") - lobe_albedo(before, "reflection")
            transmitted[number] += lobe_albedo(after, "transmission") - lobe_albedo(before, "transmission")
        total = np.maximum(reflected[number] + transmitted[number], MOST_ALBEDO)
        reflected[number] *= MOST_ALBEDO / total
        transmitted[number] *= MOST_ALBEDO / total
    return Albedos(reflected, transmitted)


def changed_lobes(baked: Sequence[Material], edited: Sequence[Material]) -> Floats:
    """(M, 3) how much light the changed lobes of materials scatter less or more, of all that they receive."""
    found = np.zeros((len(baked), 3))
    for number, (before, after) in enumerate(zip(baked, edited, strict=True)):
        if before.lobes != after.lobes:
            for side in ("reflection", "transmission"):
                found[number] += np.abs(lobe_albedo(after, side) - lobe_albedo(before, side))
    return found


def lobe_albedo(material: Material, side: str) -> Floats:
    """Equivalent diffuse albedo (3,) of a material's lobes on a side, "reflection" or "transmission"."""
    lobes = specular_only(material)
    return albedo(of_material(lobes), side) if lobes.lobes else np.zeros(3)
