"""Array types, and hashes of points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating]
Flags = NDArray[np.bool_]
Indices = NDArray[np.int64]
Image = NDArray[np.float32]  # linear Rec.709, (H, W, 3)
MIXERS = np.array([0x1E3779B97F4A7C15, 0x42B2AE3D27D4EB4F, 0x165667B19E3779F9])  # odd, without a pattern


def hashes(points: Floats) -> Indices:
    """(n,) hashes of points (n, 2) or (n, 3) in float32; those of different points hardly ever agree."""
    bits = np.asarray(points + 0.0, np.float32).view(np.int32).astype(np.int64)  # -0 is 0
    mixed = bits @ MIXERS[: bits.shape[1]]
    return np.asarray((mixed ^ (mixed >> 29)) * MIXERS[0])
