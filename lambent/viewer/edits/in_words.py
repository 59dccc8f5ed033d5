"""Shine and roughness: a material's lobes in two numbers that people without a model know."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from lambent.core.plain import triple
from lambent.materials.document import Lobe, Material
from lambent.materials.models.kurt import Kurt, KurtRetro
from lambent.materials.models.model import Parameter

LOBE = {parameter.name: parameter for parameter in Kurt.parameters}
RETRO = {parameter.name: parameter for parameter in KurtRetro.parameters}
MOST_SHINE, LEAST_SHINE = 200.0, 0.1  # per cent; at 0, the colours of lobes would be lost
ROUGH = (4.0, 100.0)  # per cent


def parameters_of(lobe: Lobe) -> Mapping[str, Parameter]:
    """The parameters of a lobe, by name."""
    return RETRO if lobe.retro else LOBE


def shine_percent(material: Material, first: Material) -> float:
    """Brightness of reflections, relative to the material at `first`."""
    return 100 * _shine(material) / (_shine(first) or _shine(material) or 1.0)


def with_shine(material: Material, first: Material, percent: float) -> Material:
    """The material with another brightness of reflections, at least `LEAST_SHINE`."""
    before = shine_percent(material, first)
    factor = max(percent, LEAST_SHINE) / before if before > 0 else 1.0
    lobes = tuple(lobe.model_copy(update={"k": triple(factor * np.array(lobe.k))}) for lobe in material.lobes)
    return material.model_copy(update={"lobes": lobes})


def rough_percent(material: Material) -> float:
    """Square root of the brightest lobe's slope, as in Burley 2012, "Physically-based shading at Disney"."""
    brightest = max(material.lobes, key=lambda lobe: sum(lobe.k), default=Lobe(mx=1.0, my=1.0))
    return 100 * math.sqrt(math.sqrt(brightest.mx * brightest.my))


def with_roughness(material: Material, percent: float) -> Material:
    """The material with another roughness, which scales all lobes."""
    wider, low, high = (percent / rough_percent(material)) ** 2, LOBE["mx"].low, LOBE["mx"].high
    lobes = []
    for lobe in material.lobes:
        mx, my = (min(max(wider * m, low), high) for m in (lobe.mx, lobe.my))
        lobes.append(lobe.model_copy(update={"mx": mx, "my": my}))
    return material.model_copy(update={"lobes": tuple(lobes)})


def _shine(material: Material) -> float:
    return sum(sum(lobe.k) for lobe in material.lobes)
