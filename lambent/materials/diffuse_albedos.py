"""Albedos of lobes, and the diffuse colours that they leave room for."""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.plain import Triple, triple
from lambent.materials.bsdf import specular_only
from lambent.materials.document import Material
from lambent.materials.factored.albedo import albedo
from lambent.materials.factored.of_lobes import of_material


def possible_kd(material: Material, kd: Triple) -> Triple:
    """A diffuse colour, reduced so that with the material's lobes and transmission no more than all light is scattered.

    A metal has less room for one than a wall.
    """
    lobes = lobe_albedo(material, "reflection") + lobe_albedo(material, "transmission")
    return triple(np.minimum(kd, np.maximum(1 - lobes - np.array(material.kt_d), 0)))


def lobe_albedo(material: Material, side: str) -> Floats:
    """Equivalent diffuse albedo (3,) of a material's lobes on a side, "reflection" or "transmission"."""
    lobes = specular_only(material)
    return albedo(of_material(lobes), side) if lobes.lobes else np.zeros(3)
