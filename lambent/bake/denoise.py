"""Filling and denoising of a light map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
Mask = NDArray[np.bool_]
SHIFTS = [(r, c) for r in (-1, 0, 1) for c in (-1, 0, 1) if (r, c) != (0, 0)]
RINGS = 16  # texels grown by nearest neighbours; what is farther from any chart is never looked up

RIM = 32  # texels mirrored at the borders, where the filter is off by up to 20 % otherwise


def fill(values: Array, known: Mask, labels: NDArray[np.integer] | None = None) -> Array:
    """Grow known texels into unknown ones: (H, W, C) with no black left.

    Parameters
    ----------
    known : (H, W) bool
        Texels whose value counts.
    labels : (H, W) int, optional
        Chart of each texel, -1 in gutters. An unknown texel within a chart takes values from its own chart first,
        so that a wall behind a cupboard is not filled with what lies next to it in the map.
    """
    filled, known = np.where(known[..., None], values, 0.0), known.copy()
    if labels is not None:
        while _grow(filled, known, labels):
            pass
    for _ in range(RINGS):
        if not _grow(filled, known, None):
            break
    if known.any() and not known.all():
        filled[~known] = filled[known].mean(axis=0)
    return filled


def _grow(filled: Array, known: Mask, labels: NDArray[np.integer] | None) -> bool:
    """One ring: unknown texels take the mean of their known neighbours (of their own chart, where labels are given)."""
    h, w = known.shape
    total, count = np.zeros_like(filled), np.zeros(known.shape)
    for row, column in SHIFTS:
        to = slice(max(0, row), h + min(0, row)), slice(max(0, column), w + min(0, column))
        at = slice(max(0, -row), h + min(0, -row)), slice(max(0, -column), w + min(0, -column))
        take = known[at] & ~known[to]
        if labels is not None:
            take &= (labels[at] == labels[to]) & (labels[to] >= 0)
        total[to] += np.where(take[..., None], filled[at], 0)
        count[to] += take
    new = count > 0
    filled[new] = total[new] / count[new][:, None]
    known |= new
    return bool(new.any())


def denoise(irradiance: Array) -> Array:
    """A noisy light map (H, W, 3) without gutters, denoised by Open Image Denoise's light map filter."""
    import pyoidn

    if not irradiance.any():
        return irradiance  # the filter would scale up its own rounding
    rim = ((RIM, RIM), (RIM, RIM), (0, 0))
    noisy = np.ascontiguousarray(np.pad(irradiance, rim, mode="symmetric"), dtype=np.float32)
    clean = np.zeros_like(noisy)
    with pyoidn.Device() as device:
        device.commit()
        with pyoidn.Filter(device, pyoidn.OIDN_FILTER_TYPE_RT_LIGHTMAP) as light_map:
            light_map.set_image(pyoidn.OIDN_IMAGE_COLOR, noisy, pyoidn.OIDN_FORMAT_FLOAT3)
            light_map.set_image(pyoidn.OIDN_IMAGE_OUTPUT, clean, pyoidn.OIDN_FORMAT_FLOAT3)
            light_map.commit()
            light_map.execute()
        error = device.get_error()
        if error is not None:
            raise RuntimeError(f"denoising failed: {error}")
    return np.maximum(clean[RIM:-RIM, RIM:-RIM], 0.0)
