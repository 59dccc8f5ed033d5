"""The faces that the sun may reach, from the texels of the light map that it reaches (`store.sunlit`).

Most of an interior gets no sun; passes that draw only these faces leave the same picture.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags, Floats

SLACK_TEXELS = 0.05  # about a face: positions of pixels at its edge are extrapolated


def sunlit_faces(sunlit: NDArray[np.uint8], uv2: Floats, faces: NDArray[np.unsignedinteger]) -> Flags:
    """(F,) whether any texel of a map (H, W), 0 for those without sun, lies in the box of a face in it.

    `uv2` (V, 2) are the places of vertices in the map, of 0 to 1; `faces` (F, 3) their indices.
    """
    size = np.array(sunlit.shape[::-1])
    sums = np.zeros(size[::-1] + 1, np.int64)
    sums[1:, 1:] = (sunlit != 0).cumsum(axis=0).cumsum(axis=1)
    texels = np.clip(np.asarray(uv2, np.float32) * size, 0, size - 1)  # as sun.wgsl finds them
    corners = np.nan_to_num(texels)[faces]
    left, top = np.maximum(corners.min(axis=1) - SLACK_TEXELS, 0).astype(int).T
    right, bottom = np.minimum(corners.max(axis=1) + SLACK_TEXELS + 1, size).astype(int).T
    count = sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]
    return np.asarray((count > 0) | np.isnan(texels).any(axis=1)[faces].any(axis=1))
