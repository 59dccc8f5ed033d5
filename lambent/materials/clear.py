"""Clear glass: surfaces that pass light straight on, and how much of it.

A lobe of transmission sends light on along its direction, spread by twice its slopes. The narrower it is, the closer is
its albedo to that of its mirrored half vector n alone (3.5):

    T(cos) = k (1 - r0) t(cos) cos^(1 - 2 alpha),    t of bsdf.under_fresnel,

with the same cosine on both sides. Panes, solids and curved glass are alike here: no material refracts. clear.wgsl is
the twin for shaders.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.materials.bsdf import under_fresnel
from lambent.materials.document import Material
from lambent.materials.lobes import COS_MIN, NUMPY, Vector

STRAIGHT = 0.005  # slope: half of the light stays within .4 degrees, not much more than the sun's disc
MOST_TERMS = 4
MOST = 0.9999  # that passes: more is no surface


def clear_terms(material: Material) -> Floats | None:
    """(n, 4) colour k (1 - r0) and exponent 1 - 2 alpha of each term of T; None where light is not passed straight on.

    Neither where a part of what passes is spread: it would have to be told from the rest.
    """
    lobes = [lobe for lobe in material.transmission_lobes if any(lobe.k)]
    spread = any(material.kt_d) or any(max(lobe.mx, lobe.my) > STRAIGHT for lobe in lobes)
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
