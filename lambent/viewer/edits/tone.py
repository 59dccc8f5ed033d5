"""Converts radiance to display bytes, fast enough for every frame of a drag."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Image
from lambent.core.light.colour import HALF_MAX, luminance, neutral, shown
from lambent.core.light.false_colour import SIGNED, Range, SignedRange, false_colour, ramp
from lambent.core.light.photometry import LUMINANCE
from lambent.core.pictures.images import to_bytes
from lambent.editing.curves.half_table import looked_up
from lambent.realtime.frame_state import FALSE_COLOUR

Bytes = NDArray[np.uint8]
ROWS = 64  # rows per block that stays in the cache: 512 x 512 pixels take 14 ms of a core instead of 24
BY_CHANNEL = ("filmic", "linear")  # transforms per channel, tabulated for all half floats


def displayed(radiance: Image, view: str, exposure_ev: float, scale: Range) -> Bytes:
    """Display bytes (H, W, 4) of radiance (H, W, 3), W/(sr m^2).

    False colours show the luminance, without exposure, on `scale`.
    """
    if view in BY_CHANNEL:
        return looked_up(radiance, _table(view, exposure_ev))
    out = np.empty((*radiance.shape[:2], 4), np.uint8)
    out[..., 3] = 255
    if view == FALSE_COLOUR:
        number = _half_bits(luminance(radiance))
        out[..., :3] = _false_colours(scale)[number]
    else:
        assert view == "neutral", view
        for top in range(0, len(out), ROWS):
            rows = slice(top, top + ROWS)
            out[rows, :, :3] = _table("linear", 0.0)[_half_bits(neutral(radiance[rows], exposure_ev))]
    return out


def difference(radiance: Image, other: Image, scale: SignedRange) -> Bytes:
    """(H, W, 4) false colours of the difference in luminance of two images."""
    out = np.empty((*radiance.shape[:2], 4), np.uint8)
    out[..., 3] = 255
    share = scale.share(luminance(radiance - other) * np.float32(LUMINANCE.per_y))
    out[..., :3] = _SIGNED[(np.nan_to_num(share, nan=0.5) * (len(_SIGNED) - 1) + 0.5).astype(np.int32)]
    return out


def _half_bits(values: Image) -> NDArray[np.uint16]:
    """Bits of half floats: one step is 0.05 %, an eighth of a display byte's step."""
    return np.clip(values, 0, HALF_MAX).astype(np.float16).view(np.uint16) & np.uint16(0x7FFF)  # -0 is 0


def _halves() -> Image:
    """The values of all unsigned half floats; NaN is black, as in `to_bytes`."""
    values = np.arange(0x8000, dtype=np.uint16).view(np.float16).astype(np.float32)
    return np.where(np.isfinite(values), values, np.float32(0))


@lru_cache(maxsize=8)
def _table(view: str, exposure_ev: float) -> Bytes:
    return to_bytes(shown(_halves(), view, exposure_ev))


@lru_cache(maxsize=8)
def _false_colours(scale: Range) -> Bytes:
    return to_bytes(false_colour(_halves() * np.float32(LUMINANCE.per_y), scale))


_SIGNED = to_bytes(ramp(np.linspace(0, 1, 2049), SIGNED))
