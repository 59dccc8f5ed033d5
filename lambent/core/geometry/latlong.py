"""Lat-long images: pixel directions. Top row +y, middle column -z, columns to the right towards +x."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from lambent.core.arrays import Floats


def lat_long_direction(theta_rad: ArrayLike, phi_rad: ArrayLike) -> Floats:
    """Unit vectors (..., 3) at angle theta from +y and phi from -z towards +x, in radians."""
    theta, phi = np.broadcast_arrays(np.asarray(theta_rad, float), np.asarray(phi_rad, float))
    return np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)], axis=-1)


def lat_long_directions(height: int, width: int, rows: slice = slice(None)) -> Floats:
    """Unit vectors (height, width, 3) of the pixel centres, or of a slice of rows."""
    theta = (np.arange(height)[rows] + 0.5) / height * np.pi
    phi = (np.arange(width) + 0.5) / width * (2 * np.pi) - np.pi
    return lat_long_direction(theta[:, None], phi)


def lat_long_uv(w: Floats) -> tuple[Floats, Floats]:
    """Column and row (...) of unit vectors (..., 3), as fractions of width and height in [0, 1]."""
    column = np.arctan2(w[..., 0], -w[..., 2]) / (2 * np.pi) + 0.5
    return column, np.arccos(np.clip(w[..., 1], -1, 1)) / np.pi
