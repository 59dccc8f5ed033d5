"""Colour as Radiance's tools write it into BSDF files: XYZ with the equal-energy white, X = Y = Z.

X and Z are scaled to the white of D65 to make linear Rec.709 RGB, so that grey stays grey and Y is the luminance of the
RGB to rounding. The files name illuminant D65 in every block, whatever they hold; Radiance ignores it.
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.light.colour import RGB_TO_XYZ, WHITE_XYZ, XYZ_TO_RGB, luminance

_WHITE_Y = WHITE_XYZ / WHITE_XYZ[1]


def rgb_of_xyz(xyz: Floats) -> Floats:
    """Linear RGB (..., 3) of equal-energy XYZ (..., 3); outside Rec.709 a channel is negative."""
    return np.asarray((xyz * _WHITE_Y) @ XYZ_TO_RGB.T)


def within_rec709(rgb: Floats) -> Floats:
    """Linear RGB (..., 3) desaturated at its luminance until no channel is negative; 0 where the luminance is."""
    y = np.maximum(luminance(rgb), 0)[..., None]
    low = rgb.min(axis=-1, keepdims=True)
    share = np.divide(y, y - low, out=np.ones_like(y), where=low < 0)
    return np.asarray(np.maximum(y + (rgb - y) * share, 0))


def xyz_of_rgb(rgb: Floats) -> Floats:
    """Equal-energy XYZ (..., 3) of linear RGB (..., 3)."""
    return np.asarray(rgb @ RGB_TO_XYZ.T / _WHITE_Y)


def xyz_of_yuv(y: Floats, u: Floats, v: Floats) -> Floats:
    """XYZ (..., 3) of luminance Y and CIE 1976 (u', v'); grey where v' is not positive."""
    real = v > 0
    v = np.where(real, v, 1.0)
    x, z = y * 9 * u / (4 * v), y * (12 - 3 * u - 20 * v) / (4 * v)
    return np.stack([np.where(real, x, y), y, np.where(real, z, y)], axis=-1)
