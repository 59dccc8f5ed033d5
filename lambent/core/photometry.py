"""Photometry: one luminous efficacy, and one meaning of every photometric unit.

Every array in Lambent is radiometric, linear Rec.709: radiance in W/(sr m^2), irradiance in W/m^2, intensity in W/sr.
`LM_PER_W` times Y turns radiance into luminance in cd/m^2, irradiance into illuminance in lx, intensity into luminous
intensity in cd, flux into luminous flux in lm. Readers of photometric files divide by the same number.

179 lm/W is the efficacy that Radiance (Ward 1994) gives white light over the visible range; spectral radiance weighted
by V(lambda) would take 683 lm/W, but the three channels each stand for a broad band.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.colour import luminance

LM_PER_W = 179.0


@dataclass(frozen=True)
class Quantity:
    """A quantity that images are shown as: its unit, and its value where Y is 1."""

    unit: str
    per_y: float


LUMINANCE, ILLUMINANCE = Quantity("cd/m2", LM_PER_W), Quantity("lx", LM_PER_W)
NOISE = Quantity("%", 100.0)  # of a relative standard error


def photometric(radiance: Floats, quantity: Quantity = LUMINANCE) -> Floats:
    """cd/m^2 (...) of linear radiance (..., 3); lx of irradiance; or another quantity."""
    return np.asarray(quantity.per_y * luminance(radiance))


def radiometric(values: Floats) -> Floats:
    """W/(sr m^2), W/m^2 or W/sr of cd/m^2, lx or cd."""
    return np.asarray(values / LM_PER_W)
