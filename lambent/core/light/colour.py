"""Colour: linear Rec.709 RGB (the colour space of every array in Lambent), XYZ, L*a*b*, and display encoding.

All functions take and return arrays (..., 3) and keep the dtype of floating input. White is D65 (Y = 1 at RGB 1, 1, 1).
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.plain import Triple, triple

# IEC 61966-2-1. The inverse is computed, not quoted: the round trip is exact up to rounding.
RGB_TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
XYZ_TO_RGB = np.linalg.inv(RGB_TO_XYZ)
WHITE_XYZ = RGB_TO_XYZ.sum(axis=1)
REC_709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)  # x and y of red, green, blue and white
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
_LAB_EDGE = 6 / 29
HALF_MAX = 65504.0  # largest half float; brighter light is clipped to it
MOST_UNIT = 2.0**24  # largest unit of light stored as half floats


def luminance(rgb: Floats) -> Floats:
    """Y (...) of linear RGB (..., 3)."""
    return np.asarray(rgb @ RGB_TO_XYZ[1].astype(rgb.dtype))


def in_halves(light: Floats) -> tuple[NDArray[np.float16], float]:
    """Light (...) >= 0 as half floats, and their unit: the least power of two, at least 1, that avoids overflow.

    The sun's radiance is 7e6 W/(sr m^2), a hundred times the largest half float.
    """
    unit = unit_of_halves(float(light.max(initial=0.0)))
    return halves(light, unit), unit


def unit_of_halves(brightest: float) -> float:
    """The least power of two, from 1 to MOST_UNIT, in which light up to `brightest` fits into half floats."""
    return float(2.0 ** np.ceil(np.log2(min(max(brightest / HALF_MAX, 1.0), MOST_UNIT))))


def halves(light: Floats, unit: float) -> NDArray[np.float16]:
    """Light (...) >= 0 in multiples of `unit`, as half floats; clipped to HALF_MAX."""
    return np.asarray(np.minimum(light / unit, HALF_MAX), np.float16)


def rgb_to_xyz(rgb: Floats) -> Floats:
    """Linear RGB to CIE XYZ."""
    return np.asarray(rgb @ RGB_TO_XYZ.T.astype(rgb.dtype))


def xyz_to_rgb(xyz: Floats) -> Floats:
    """CIE XYZ to linear RGB; colours outside Rec.709 come out negative."""
    return np.asarray(xyz @ XYZ_TO_RGB.T.astype(xyz.dtype))


def from_primaries(xy: Floats) -> NDArray[np.float32] | None:
    """(3, 3) matrix to linear Rec.709 from linear RGB of other primaries, or None if they span no colours.

    `xy` (4, 2) are chromaticities of red, green, blue and white. White becomes white, adapted as by Bradford (the ICC
    profile specification, annex E).
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        primaries, white = (_xyz_of(points) for points in (xy[:3], xy[3]))
    if not (np.isfinite(primaries).all() and np.isfinite(white).all()) or np.linalg.cond(primaries) > 1e4:
        return None
    to_xyz = primaries.T * np.linalg.solve(primaries.T, white)
    gains = (_BRADFORD @ WHITE_XYZ) / (_BRADFORD @ white)
    adapted = np.linalg.solve(_BRADFORD, gains[:, None] * _BRADFORD)
    return np.asarray(XYZ_TO_RGB @ adapted @ to_xyz, np.float32)


def _xyz_of(xy: Floats) -> Floats:
    """(..., 3) XYZ with Y = 1 of chromaticities (..., 2)."""
    x, y = xy[..., 0].astype(float), xy[..., 1].astype(float)
    return np.stack([x / y, np.ones_like(y), (1 - x - y) / y], axis=-1)


def rgb_to_lab(rgb: Floats) -> Floats:
    """Linear RGB to CIE L*a*b* (D65); L* of white is 100."""
    t = rgb_to_xyz(rgb) / WHITE_XYZ.astype(rgb.dtype)
    f = np.where(t > _LAB_EDGE**3, np.cbrt(t), t / (3 * _LAB_EDGE**2) + 4 / 29)
    x, y, z = f[..., 0], f[..., 1], f[..., 2]
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def srgb_encode(linear: Floats) -> Floats:
    """Linear values to sRGB, clipped to [0, 1]."""
    x = np.clip(linear, 0, 1)
    # np.where evaluates both sides, so the power is taken of max(x, edge).
    curve = 1.055 * np.maximum(x, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(x <= 0.0031308, 12.92 * x, curve).astype(x.dtype)


def srgb_decode(encoded: Floats) -> Floats:
    """sRGB values in [0, 1] to linear."""
    curve = ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, encoded / 12.92, curve).astype(encoded.dtype)


def hex_of(linear: Floats) -> str:
    """The sRGB colour #rrggbb of a linear one (3,), clipped to 0 and 1."""
    return "#" + np.round(255 * np.clip(srgb_encode(np.asarray(linear)), 0, 1)).astype(np.uint8).tobytes().hex()


def hex_colour(text: str) -> Triple | None:
    """Linear RGB of the sRGB colour #rrggbb; None for any other text."""
    if not re.fullmatch(r"#[0-9a-fA-F]{6}", text):
        return None
    return triple(srgb_decode(np.frombuffer(bytes.fromhex(text[1:]), np.uint8) / 255))


def filmic(linear: Floats, exposure_ev: float = 0.0) -> Floats:
    """Scene radiance to display-linear [0, 1] by a filmic curve: toe, straight part, shoulder.

    The rational fit of Narkowicz 2015, "ACES filmic tone mapping curve", per channel. Encode the result with
    `srgb_encode`.
    """
    x = np.maximum(linear, 0) * np.asarray(2.0**exposure_ev, linear.dtype)
    x = np.minimum(x, 1e4)  # the curve is flat there; squares of larger half floats would overflow
    curve = np.clip(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0, 1)
    return np.asarray(curve, linear.dtype)


def neutral(linear: Floats, exposure_ev: float = 0.0) -> Floats:
    """Scene radiance to display-linear [0, 1]; colours below .76 are unchanged. Khronos PBR Neutral (2024)."""
    x = np.maximum(linear, 0) * np.asarray(2.0**exposure_ev, linear.dtype)
    low = _across(np.minimum, x)
    x = x - np.where(low < 0.08, low - 6.25 * low * low, 0.04)
    peak = _across(np.maximum, x)
    start, room = 0.76, 0.24
    new_peak = 1 - room * room / (np.maximum(peak, start) + room - start)
    grey = 1 - 1 / (0.15 * (np.maximum(peak, start) - new_peak) + 1)
    rolled = x * new_peak / np.maximum(peak, start) * (1 - grey) + new_peak * grey
    return np.asarray(np.clip(np.where(peak < start, x, rolled), 0, 1), linear.dtype)


def _across(least_or_most: np.ufunc, rgb: Floats) -> Floats:
    """Least or largest of the three channels (..., 1); several times faster than a reduction over so short an axis."""
    return np.asarray(least_or_most(least_or_most(rgb[..., :1], rgb[..., 1:2]), rgb[..., 2:]))


def shown(radiance: Floats, view: str, exposure_ev: float = 0.0) -> Floats:
    """Scene radiance encoded for a display by a view transform: filmic, neutral or linear."""
    if view == "linear":
        return srgb_encode(radiance * np.asarray(2.0**exposure_ev, radiance.dtype))
    return srgb_encode({"filmic": filmic, "neutral": neutral}[view](radiance, exposure_ev))
