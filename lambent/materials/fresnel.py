"""Factors of microfacet models: Fresnel reflectance, exact and by Schlick's approximation, and Smith's masking.

Cosines are between a direction and the facet's normal, in [0, 1]. `lobes.fresnel` is the Schlick term for the path
tracer.
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats
from lambent.materials.document import Distribution


def schlick_weight(cos_d: Floats) -> Floats:
    """(1 - cos_d)^5."""
    return np.asarray(np.maximum(1 - cos_d, 0.0) ** 5)


def schlick(cos_d: Floats, r0: Floats) -> Floats:
    """Schlick's approximation r0 + (1 - r0)(1 - cos_d)^5, (..., C), for cos_d (...) and r0 (C,)."""
    return np.asarray(r0 + (1 - r0) * schlick_weight(cos_d)[..., None])


def conductor(cos_d: Floats, n: Floats | float, k: Floats | float) -> Floats:
    """Reflectance of unpolarised light from air at the index n + i k (k = 0: a dielectric), in [0, 1].

    Born and Wolf, 14.2: a^2 + b^2 and a are the modulus and the real part of sqrt((n + i k)^2 - sin^2).
    """
    cos2 = cos_d * cos_d
    sin2 = 1 - cos2
    real = n * n - k * k - sin2
    modulus = np.sqrt(real * real + 4 * n * n * k * k)
    a = np.sqrt(np.maximum((modulus + real) / 2, 0.0))
    perpendicular = (modulus + cos2 - 2 * a * cos_d) / (modulus + cos2 + 2 * a * cos_d)
    sum_, difference = modulus * cos2 + sin2 * sin2, 2 * a * cos_d * sin2
    return np.asarray(perpendicular * (1 + (sum_ - difference) / (sum_ + difference)) / 2)


def r0_of(ior: float) -> float:
    """Reflectance at normal incidence of a dielectric of this index in air."""
    return ((ior - 1) / (ior + 1)) ** 2


def ior_of(r0: float) -> float:
    """Inverse of `r0_of`: the index above 1."""
    root = float(np.sqrt(r0))
    return (1 + root) / (1 - root)


def smith_lambda(slope2: Floats, distribution: Distribution) -> Floats:
    """Smith's Lambda of GGX (Heitz 2014, eq. 72) or Beckmann facets for slope2 = (m tan theta)^2; G1 = 1/(1 + Lambda).

    Beckmann's is the rational fit of Walter et al. 2007, as Mitsuba and pbrt use it.
    """
    if distribution == "ggx":
        return np.asarray((np.sqrt(1 + slope2) - 1) / 2)
    a = 1 / np.sqrt(np.maximum(slope2, 1e-12))
    return np.where(a >= 1.6, 0.0, (1 - 1.259 * a + 0.396 * a * a) / (3.535 * a + 2.181 * a * a))
