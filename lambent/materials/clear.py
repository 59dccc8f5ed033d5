"""Clear glass: surfaces that transmit light undeviated, and their transmittance.

A transmission lobe sends light on along its direction, spread by twice its slopes. As it narrows, its albedo approaches
the value for half vector n alone, once mirrored (3.5):

    T(cos) = k (1 - r0) t(cos) cos^(1 - 2 alpha),    t of bsdf.under_fresnel,

with the same cosine on both sides. Panes, solids and curved glass are treated alike: no material refracts. clear.wgsl
is the shader version.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.materials.bsdf import under_fresnel
from lambent.materials.document import Material
from lambent.materials.lobes import COS_MIN, NUMPY, Vector, widths

STRAIGHT = 0.005  # slope: half of the light stays within .4 degrees, little more than the sun's disc
MOST_TERMS = 4
MOST = 0.9999  # transmittance above which there is effectively no surface


def clear_terms(material: Material) -> Floats | None:
    """(n, 4) colour k (1 - r0) and exponent 1 - 2 alpha of each term of T; None unless light is transmitted undeviated.

    Also None if part of the transmitted light is scattered, because the two could not be separated.
    """
    lobes = [lobe for lobe in material.transmission_lobes if any(lobe.k)]
    spread = any(material.kt_d) or any(max(widths(lobe)) > STRAIGHT for lobe in lobes)
    if spread or not 0 < len(lobes) <= MOST_TERMS:
        return None
    return np.array([[*(np.asarray(lobe.k) * (1 - np.asarray(lobe.r0))), 1 - 2 * lobe.alpha] for lobe in lobes])


def transmittance(cosine: Any, terms: Floats, ops: Any = NUMPY) -> Vector:
    """T of each channel at cosines from `COS_MIN` to 1."""
    cosine = ops.maximum(cosine, COS_MIN)
    drawn = [ops.power(cosine, float(exponent)) for exponent in terms[:, 3]]
    red, green, blue = (
        ops.minimum(
            under_fresnel(cosine, ops) * sum(float(k) * x for k, x in zip(terms[:, c], drawn, strict=True)), MOST
        )
        for c in range(3)
    )
    return red, green, blue
