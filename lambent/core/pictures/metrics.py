"""Differences of two images. A mean hides a hole, so the worst 16x16 tile is always reported with it.

Images are linear RGB (H, W, 3), unless `encoded` for a display: sRGB values in [0, 1].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.light.colour import rgb_to_lab, srgb_encode

TILE = 16  # pixels
MOST_LIT = 2 / 3  # limit for the displayed mean of pixels that are not black


@dataclass(frozen=True)
class Flip:
    """FLIP error (Andersson et al. 2020): 0 is no visible difference, 1 the maximum."""

    error: Floats  # (H, W)
    picture: Floats  # (H, W, 3) encoded, in false colour: black no error, yellow-white 1

    @property
    def mean(self) -> float:
        return float(self.error.mean())

    @property
    def worst_tile(self) -> float:
        """Largest mean over a 16x16 tile."""
        return float(tile_means(self.error).max())

    @property
    def worst_tile_at(self) -> tuple[int, int]:
        """Row and column of the worst tile's top left pixel."""
        means = tile_means(self.error)
        row, column = np.unravel_index(int(means.argmax()), means.shape)
        return int(row) * TILE, int(column) * TILE


def psnr(reference: Floats, test: Floats, peak: float = 1.0) -> float:
    """Peak signal-to-noise ratio in dB over arrays of equal shape; `peak` is the largest value. Infinite if equal."""
    mse = float(np.mean((np.asarray(reference, np.float64) - test) ** 2))
    return 10 * float(np.log10(peak**2 / mse)) if mse > 0 else float("inf")


def rmse_rgb(reference: Floats, test: Floats) -> Floats:
    """Root mean square error (3,) per channel."""
    return np.asarray(np.sqrt(np.mean((np.asarray(reference, np.float64) - test) ** 2, axis=(0, 1))))


def rmse_lab(reference: Floats, test: Floats) -> Floats:
    """Root mean square error (3,) in L*, a*, b* of linear RGB."""
    return rmse_rgb(rgb_to_lab(np.asarray(reference, np.float64)), rgb_to_lab(np.asarray(test, np.float64)))


def flip(reference: Floats, test: Floats) -> Flip:
    """FLIP of two encoded images at 67 pixels per degree (a desktop display at arm's length)."""
    return Flip(flip_error(reference, test), _flip(reference, test, in_colour=True))


def flip_error(reference: Floats, test: Floats) -> Floats:
    """The error (H, W) of `flip` alone, in half the time."""
    error = _flip(reference, test, in_colour=False)
    return error[..., 0] if error.ndim == 3 else error


def _flip(reference: Floats, test: Floats, in_colour: bool) -> Floats:
    import flip_evaluator

    pair = [np.ascontiguousarray(np.clip(picture, 0, 1), np.float32) for picture in (reference, test)]
    error, _, _ = flip_evaluator.evaluate(*pair, "LDR", applyMagma=in_colour, computeMeanError=False)
    return np.asarray(error)


def compare(reference: Floats, test: Floats, *, radiance: bool) -> tuple[dict[str, Any], Floats]:
    """All metrics of two linear RGB images (H, W, 3), and the FLIP error in false colour (H, W, 3), encoded.

    PSNR and FLIP compare displayed values: at a common exposure for scene `radiance`, otherwise sRGB-encoded.
    """
    shown = display_pair(reference, test) if radiance else (srgb_encode(reference), srgb_encode(test))
    seen = flip(*shown)
    return {
        "size": [reference.shape[1], reference.shape[0]],
        "compared_as": "radiance" if radiance else "display",
        "psnr_db": psnr(*shown),
        "rmse_rgb": rmse_rgb(reference, test),
        "rmse_lab": rmse_lab(reference, test),
        "flip_mean": seen.mean,
        "flip_worst_tile": seen.worst_tile,
        "flip_worst_tile_at": seen.worst_tile_at,
    }, seen.picture


def tile_means(error: Floats, tile: int = TILE) -> Floats:
    """Means (ceil H/tile, ceil W/tile) over the tiles of (H, W); tiles at the lower and right border may be smaller."""
    rows, columns = np.arange(0, error.shape[0], tile), np.arange(0, error.shape[1], tile)
    sums = np.add.reduceat(np.add.reduceat(error.astype(np.float64), rows, axis=0), columns, axis=1)
    heights, widths = np.diff([*rows, error.shape[0]]), np.diff([*columns, error.shape[1]])
    return np.asarray(sums / np.outer(heights, widths))


def display_pair(reference: Floats, test: Floats, mean: float = 0.3) -> tuple[Floats, Floats]:
    """Two images of radiance encoded as clip(e L)^(1/2.2), with e chosen to give the reference mean `mean`."""
    exposure_ev = display_exposure(reference, mean)
    return displayed(reference, exposure_ev), displayed(test, exposure_ev)


def display_exposure(reference: Floats, mean: float = 0.3) -> float:
    """log2 of the factor e at which `displayed` gives an image of radiance the mean `mean`.

    The mean over values above 0 stays at most `MOST_LIT`: otherwise a small light on black would clip at any
    brightness. Found by bisection: clipping makes the mean monotone in e, but not linear.
    """
    mean = min(mean, MOST_LIT * float(np.mean(np.asarray(reference) > 0)))
    low, high = -40.0, 40.0  # stops
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if displayed(reference, middle).mean() <= mean else (low, middle)
    return low


def displayed(radiance: Floats, exposure_ev: float) -> Floats:
    """clip(2^exposure_ev L)^(1/2.2)."""
    return np.asarray(np.clip(np.asarray(radiance, np.float64) * 2.0**exposure_ev, 0, 1) ** (1 / 2.2))
