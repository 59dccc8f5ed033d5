"""Exposure: stops on radiance, EV100, and a light meter that maps a picture's log-average to middle grey.

Displayed light is radiance times 2^exposure_ev. EV100 (ISO 100, saturation-based speed, ISO 12232): 1.2 cd/m^2 x
2^EV100 is the brightest luminance with detail, displayed as 1; a larger EV100 darkens the picture.
"""

from __future__ import annotations

import math

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.light.photometry import LM_PER_W, photometric

KEY = 0.18  # middle grey: the meter's target for the log-average (Reinhard et al. 2002)
SATURATED_CD_M2 = 1.2  # at EV100 0
LIMIT_EV = 12.0
BRIGHT_SHARE = 0.005  # share of the pixels that the meter ignores as suns and lamps
SPAN_STOPS = 10.0  # below the brightest metered pixel; darker pixels count as black surroundings
TRIM = 0.05  # share of the remaining pixels trimmed at each end


def ev100_of(exposure_ev: float) -> float:
    """EV100 of an exposure in stops on radiance."""
    return math.log2(LM_PER_W / SATURATED_CD_M2) - exposure_ev


def exposure_of(ev100: float) -> float:
    """Stops on radiance of an EV100."""
    return math.log2(LM_PER_W / SATURATED_CD_M2) - ev100


def metered(radiance: Floats) -> float | None:
    """Exposure in stops that maps the log-average of a picture (H, W, 3) to `KEY`, within +-LIMIT_EV; None if black.

    Suns or lamps in view and black surroundings do not change it: see the constants.
    """
    y = photometric(np.asarray(radiance, np.float64)).ravel() / LM_PER_W
    stops = np.sort(np.log2(y[np.isfinite(y) & (y > 0)]))
    if not stops.size:
        return None
    stops = stops[: max(1, round((1 - BRIGHT_SHARE) * stops.size))]
    stops = stops[stops >= stops[-1] - SPAN_STOPS]
    cut = int(TRIM * stops.size)
    middle = float(stops[cut : stops.size - cut].mean())
    return min(max(math.log2(KEY) - middle, -LIMIT_EV), LIMIT_EV)
