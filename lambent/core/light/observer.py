"""The CIE 1931 2 degree standard observer and illuminant D65, every nanometre (CIE 018:2019, CIE S 014)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from lambent.core.arrays import Floats


@dataclass(frozen=True, eq=False)
class Observer:
    """`wavelengths_nm` (K,), the colour matching functions `matching` (K, 3), and the power of `d65` (K,)."""

    wavelengths_nm: Floats
    matching: Floats
    d65: Floats


@cache
def observer() -> Observer:
    """The observer from 360 to 830 nm."""
    text = (files("lambent.core.light") / "cie_1931.csv").read_text("ascii")
    columns = np.loadtxt(text.splitlines(), delimiter=",", skiprows=1)
    return Observer(columns[:, 0], columns[:, 1:4], columns[:, 4])


def black_body_xyz(temperature_k: Floats | float) -> Floats:
    """XYZ (..., 3) of black bodies at temperatures (...), in W/(sr m^2): Planck's law times the matching functions."""
    metres = observer().wavelengths_nm * 1e-9
    h, c, k = 6.62607015e-34, 2.99792458e8, 1.380649e-23
    shares = np.expm1(h * c / (metres * k * np.asarray(temperature_k)[..., None]))
    return np.asarray(2e-9 * h * c**2 / metres**5 / shares @ observer().matching)
