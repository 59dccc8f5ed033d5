"""Spectra of reflectance to linear RGB."""

from __future__ import annotations

import numpy as np

from lambent.core.colour import XYZ_TO_RGB
from lambent.core.frames import Floats


def rgb_of_spectra(wavelengths_nm: Floats) -> Floats:
    """(3, K) matrix that takes K spectral values of a reflectance or BSDF to linear RGB (Rec.709).

    CIE 1931 2 degree observer under illuminant D65, whose white is the white of Rec.709: a flat spectrum of value v
    becomes (v, v, v). Between the wavelengths the spectrum is taken as linear, beyond them as constant. Saturated
    spectra can have a negative channel.

    Parameters
    ----------
    wavelengths_nm : (K,) increasing
    """
    from colour import MSDS_CMFS, SDS_ILLUMINANTS

    observer, d65 = MSDS_CMFS["CIE 1931 2 Degree Standard Observer"], SDS_ILLUMINANTS["D65"]
    fine_nm = np.arange(360.0, 781.0)
    cmf = np.stack([np.interp(fine_nm, observer.wavelengths, column) for column in observer.values.T])
    power = np.interp(fine_nm, d65.wavelengths, d65.values)
    hats = np.stack([np.interp(fine_nm, wavelengths_nm, unit) for unit in np.eye(len(wavelengths_nm))])
    xyz = (cmf * power) @ hats.T / (cmf[1] * power).sum()
    rgb = XYZ_TO_RGB @ xyz
    return np.asarray(rgb / rgb.sum(axis=1, keepdims=True))  # observer and primaries round the white differently
