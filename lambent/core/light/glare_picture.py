"""A picture of a view with its glare sources marked."""

from __future__ import annotations

import colorsys

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.light.colour import luminance, shown
from lambent.core.light.glare import Glare
from lambent.core.pictures.images import to_bytes

MARK_SHARE = 0.6  # opacity of the mark over a source


def marked(radiance: Floats, found: Glare) -> NDArray[np.uint8]:
    """(H, W, 3) display values: the background at a fitting exposure, each source in its own hue."""
    lit = luminance(radiance)[(found.numbers == 0) & (radiance.max(axis=-1) > 0)]
    exposure_ev = float(np.log2(0.18 / np.exp(np.log(lit).mean()))) if len(lit) and lit.min() > 0 else 0.0
    picture = np.asarray(shown(radiance, "filmic", exposure_ev), float)
    hues = [colorsys.hsv_to_rgb((0.618034 * k) % 1, 0.9, 1.0) for k in range(len(found.sources))]
    colours = np.array([(0.0, 0.0, 0.0), *hues])[found.numbers]
    share = MARK_SHARE * (found.numbers > 0)[..., None]
    return to_bytes(picture * (1 - share) + colours * share)
