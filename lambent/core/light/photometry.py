"""Photometry: one luminous efficacy for all photometric units.

Every array in Lambent is radiometric, linear Rec.709: radiance in W/(sr m^2), irradiance in W/m^2, intensity in W/sr.
`LM_PER_W` times Y converts radiance to luminance in cd/m^2, irradiance to illuminance in lx, intensity to luminous
intensity in cd, flux to luminous flux in lm. Readers of photometric files divide by the same constant.

179 lm/W is Radiance's efficacy of white light over the visible range (Ward 1994). Spectral radiance weighted by
V(lambda) would take 683 lm/W, but each of the three channels stands for a broad band.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.light.colour import luminance

LM_PER_W = 179.0


@dataclass(frozen=True)
class Quantity:
    """A displayed quantity: its unit, and its value at Y = 1."""

    unit: str
    per_y: float


LUMINANCE, ILLUMINANCE = Quantity("cd/m2", LM_PER_W), Quantity("lx", LM_PER_W)
NOISE = Quantity("%", 100.0)  # of a relative standard error


def photometric(radiance: Floats, quantity: Quantity = LUMINANCE) -> Floats:
    """cd/m^2 (...) of linear radiance (..., 3); lx of irradiance; or another `quantity`."""
    return np.asarray(quantity.per_y * luminance(radiance))


def radiometric(values: Floats) -> Floats:
    """W/(sr m^2) of cd/m^2, W/m^2 of lx, or W/sr of cd."""
    return np.asarray(values / LM_PER_W)
