"""Transport as it is stored: half floats, wavelets of one curve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.wavelets import transformed
from lambent.scenes.triangle_lights import TriangleLights

STEPS = 256  # parts of the scale that half floats have left above 1: quotients are larger than 1 at grazing angles
HALF_MAX = float(np.finfo(np.float16).max)


def scale_of(lights: TriangleLights) -> float:
    """What stored values are multiples of, W/(sr m^2): half floats reach from 1e-9 to 250 times all the light."""
    most = lights.light.max(axis=1, initial=0.0) * np.where(lights.near, 2 * np.pi, 1.0)
    return max(float(most.sum()), 1e-30) / STEPS


def wavelet_rows(bands: NDArray[np.float32], scale: float) -> NDArray[np.float16]:
    """(J, 3, P) half floats, wavelets, of transport (J, 3, P) by bands."""
    return np.asarray(np.clip(transformed(bands) / np.float32(scale), -HALF_MAX, HALF_MAX), np.float16)
