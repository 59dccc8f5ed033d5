"""Diffuse albedos of materials for light between surfaces, with equivalent albedos for edited lobes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lambent.baked.answering.answer import MOST_ALBEDO, Albedos
from lambent.core.arrays import Floats
from lambent.materials.document import Material
from lambent.materials.factored.albedo import lobe_albedo


def albedos_of(materials: Sequence[Material]) -> Albedos:
    """kd and kt_d of materials; light scattered by lobes is included in the rays instead."""
    shape = (len(materials), 3)
    return Albedos(
        np.array([m.kd for m in materials], float).reshape(shape),
        np.array([m.kt_d for m in materials], float).reshape(shape),
    )


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
