"""Tell whether a pair of directions is nearer to the peak about the mirror direction or to the peak about the light.

The back vector (Belcour et al. 2014, see lobes.py) is the half vector of the viewer and the light's mirror image about
n. A retro-reflecting peak has the same back vector for every direction of the light, as a mirror-like peak has the same
half vector. Along the normal the peaks coincide and count as the light's.
"""

from __future__ import annotations

from typing import Any

from lambent.materials.lobes import NUMPY, ArrayOps, Vector

_COS_NORMAL = 1 - 1e-6  # .08 degrees
_STEEPNESS = 2.0  # from 0 to 1 over half the range of the measure below


def back_share(wi: Vector, wo: Vector, ops: ArrayOps = NUMPY) -> Any:
    """1 if wo is nearer to wi than to its mirror image, 0 if farther; continuous in between.

    Based on (|h_b| - |h|)/(|h_b| + |h|) of the squared tangential components of wi + wo and wi' + wo; symmetric in wi
    and wo. 1 for wi or wo along the normal.
    """
    across = wi[0] * wo[0] + wi[1] * wo[1]
    size = wi[0] * wi[0] + wi[1] * wi[1] + wo[0] * wo[0] + wo[1] * wo[1]
    nearness = 2 * across / ops.maximum(size, 1e-12)  # -1 at the mirror direction, 1 towards the light
    share = ops.minimum(ops.maximum(0.5 + _STEEPNESS * nearness, 0.0), 1.0)
    return ops.select((wi[2] > _COS_NORMAL) | (wo[2] > _COS_NORMAL), 1.0, share)
