"""Procedural surroundings, by name, as lat-long images of linear radiance."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.geometry.latlong import lat_long_directions
from lambent.scenes.sky.gardens import GARDENS
from lambent.scenes.sky.interiors import INTERIORS

HEIGHT, SAMPLES = 384, 2  # rows of an image; samples per texel and axis
COMPUTED: Mapping[str, Callable[[Floats], Floats]] = {**INTERIORS, **GARDENS}


@cache
def lat_long_image(name: str) -> NDArray[np.float32]:
    """(HEIGHT, 2 HEIGHT, 3) radiance in W/(sr m^2) of surroundings of `COMPUTED`; see `core.geometry.latlong`."""
    height, width = HEIGHT * SAMPLES, 2 * HEIGHT * SAMPLES
    fine = COMPUTED[name](lat_long_directions(height, width))
    return np.asarray(fine.reshape(HEIGHT, SAMPLES, 2 * HEIGHT, SAMPLES, 3).mean(axis=(1, 3)), np.float32)
