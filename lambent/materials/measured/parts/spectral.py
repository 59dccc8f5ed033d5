"""Measured spectra and tristimulus values to linear RGB, and equal-energy XYZ.

Radiance's tools write colour into BSDF files as XYZ with the equal-energy white, X = Y = Z. X and Z are scaled to the
white of D65 to make linear Rec.709 RGB, so that grey stays grey and Y is the luminance of the RGB to rounding. The
files name illuminant D65 in every block, whatever they hold; Radiance ignores it.
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.light.colour import RGB_TO_XYZ, WHITE_XYZ, XYZ_TO_RGB, luminance, xyz_to_rgb
from lambent.core.light.observer import observer

LONGEST_NM = 780.0  # of a reflectance
_WHITE_Y = WHITE_XYZ / WHITE_XYZ[1]


def rgb_of_equal_energy(xyz: Floats) -> Floats:
    """Linear RGB (..., 3) of equal-energy XYZ (..., 3); outside Rec.709 a channel is negative."""
    return np.asarray((xyz * _WHITE_Y) @ XYZ_TO_RGB.T)


def within_rec709(rgb: Floats) -> Floats:
    """Linear RGB (..., 3) desaturated at its luminance until no channel is negative; 0 where the luminance is."""
    y = np.maximum(luminance(rgb), 0)[..., None]
    low = rgb.min(axis=-1, keepdims=True)
    share = np.divide(y, y - low, out=np.ones_like(y), where=low < 0)
    return np.asarray(np.maximum(y + (rgb - y) * share, 0))


def equal_energy_of_rgb(rgb: Floats) -> Floats:
    """Equal-energy XYZ (..., 3) of linear RGB (..., 3)."""
    return np.asarray(rgb @ RGB_TO_XYZ.T / _WHITE_Y)


def xyz_of_yuv(y: Floats, u: Floats, v: Floats) -> Floats:
    """XYZ (..., 3) of luminance Y and CIE 1976 (u', v'); grey where v' is not positive."""
    real = v > 0
    v = np.where(real, v, 1.0)
    x, z = y * 9 * u / (4 * v), y * (12 - 3 * u - 20 * v) / (4 * v)
    return np.stack([np.where(real, x, y), y, np.where(real, z, y)], axis=-1)


def rgb_of_spectra(wavelengths_nm: Floats) -> Floats:
    """Matrix (3, K) that converts K spectral values of a reflectance or BSDF to linear RGB (Rec.709).

    CIE 1931 2 degree observer under illuminant D65, whose white is that of Rec.709: a flat spectrum of value v becomes
    (v, v, v). The spectrum is linear between the wavelengths and constant beyond them. Saturated spectra can give a
    negative channel.

    Parameters
    ----------
    wavelengths_nm : (K,) increasing
    """
    visible = observer().wavelengths_nm <= LONGEST_NM
    fine_nm, power = observer().wavelengths_nm[visible], observer().d65[visible]
    cmf = observer().matching[visible].T
    hats = np.stack([np.interp(fine_nm, wavelengths_nm, unit) for unit in np.eye(len(wavelengths_nm))])
    xyz = (cmf * power) @ hats.T / (cmf[1] * power).sum()
    rgb = XYZ_TO_RGB @ xyz
    return np.asarray(rgb / rgb.sum(axis=1, keepdims=True))  # observer and primaries round the white point differently


def rgb_of_measured(spectra: Floats, usable: Flags, wavelengths_nm: Floats) -> tuple[Floats, tuple[str, ...]]:
    """Linear RGB (N, 3) of spectra (N, K), and notes; NaN where not usable; readings below zero stay below."""
    rgb = np.full((len(spectra), 3), np.nan)
    rgb[usable] = spectra[usable] @ rgb_of_spectra(wavelengths_nm).T
    rgb, outside = _within_gamut(rgb, spectra)
    notes: tuple[str, ...] = ("spectra were converted to linear RGB under D65",)
    if outside:
        notes += (f"{outside} spectra are more saturated than Rec.709; the negative channel became 0",)
    return rgb, notes


def rgb_of_xyz(values: Floats) -> tuple[Floats, tuple[str, ...]]:
    """Linear RGB (..., 3) of tristimulus values under D65, and notes; negative values stay negative."""
    rgb, outside = _within_gamut(xyz_to_rgb(values), values)
    notes: tuple[str, ...] = ("tristimulus values were converted to linear RGB under D65",)
    if outside:
        notes += (f"{outside} values are more saturated than Rec.709; the negative channel became 0",)
    return rgb, notes


def _within_gamut(rgb: Floats, source: Floats) -> tuple[Floats, int]:
    """RGB (..., 3) with negative channels of colours outside Rec.709 removed, and the number of such colours.

    The source (..., K) of such a colour, spectral or tristimulus values, is nowhere negative; otherwise it is noise.
    """
    with np.errstate(invalid="ignore"):
        outside = np.any(rgb < 0, axis=-1, keepdims=True) & np.all(source >= 0, axis=-1, keepdims=True)
    return np.where(outside, np.maximum(rgb, 0), rgb), int(outside.sum())
