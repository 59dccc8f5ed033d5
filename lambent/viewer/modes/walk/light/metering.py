"""An exposure meter: mean, log-average and histogram of the picture's luminance, and the resulting exposure."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.light.exposure import metered
from lambent.core.light.false_colour import Range, fitting_range
from lambent.core.light.photometry import LUMINANCE, Quantity, photometric
from lambent.viewer.modes.walk.light.glare import GlareMeter

PIXELS = 60_000  # evenly spread pixels of a reading
BINS_PER_DECADE = 12


@dataclass(frozen=True)
class Reading:
    """Reading of one picture, in the unit of its quantity. `counts` (B,) lie between `edges` (B + 1,)."""

    mean: float
    log_mean: float
    low: float
    high: float
    counts: Floats = field(compare=False)
    edges: Floats = field(compare=False)
    ranges: tuple[Range, Range] = (Range(), Range())  # ranges of the picture: logarithmic, linear
    exposure_ev: float = 0.0  # shows the log-average as middle grey (core.exposure)


def read(radiance: Floats, quantity: Quantity = LUMINANCE) -> Reading | None:
    """Reading of a picture (H, W, 3) of radiance, or of another quantity; None if it is black."""
    every = max(1, math.isqrt(radiance.shape[0] * radiance.shape[1] // PIXELS))
    some = np.asarray(radiance[every // 2 :: every, every // 2 :: every], np.float64)
    values = photometric(some, quantity).ravel()
    values = values[np.isfinite(values)]
    lit = values[values > 0]
    if not lit.size:
        return None
    low, high = float(lit.min()), float(lit.max())
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high) + 1e-9)
    first = max(first, last - 7)
    edges = np.logspace(first, last, (last - first) * BINS_PER_DECADE + 1)
    return Reading(
        float(values.mean()),
        float(np.exp(np.log(lit).mean())),
        low,
        high,
        np.histogram(np.clip(lit, edges[0], None), edges)[0].astype(float),
        edges,
        (fitting_range(values), fitting_range(values, log=False)),
        metered(some) or 0.0,
    )


@dataclass
class Meter:
    """The window's meter. The panel sets `wanted` in every frame in which it is drawn."""

    wanted: bool = False
    fit_wanted: bool = False  # whether the next reading sets the range of false colours
    expose_wanted: bool = False  # whether the next reading sets the exposure
    fitted: set[bool] = field(default_factory=set)  # fitted ranges: of noise (True), of light (False)
    reading: Reading | None = None
    cursor: tuple[float, float] | None = None  # mouse position as shares of the picture
    readout_on: bool = False  # whether the luminance under the mouse is shown; always in false colours
    under_cursor: tuple[float, float, float] | None = None  # radiance there
    glare: GlareMeter = field(default_factory=GlareMeter)
