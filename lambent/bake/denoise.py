"""Filling and denoising of a light map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
Mask = NDArray[np.bool_]
RINGS = 16  # texels grown into gutters; what is farther from any chart is never looked up
RIM = 32  # texels mirrored at the borders, where the filter is off by up to 20 % otherwise


def fill(values: Array, known: Mask, labels: NDArray[np.integer], *, smooth: int = 0) -> Array:
    """Grow known texels into unknown ones: (H, W, C) with no black left.

    Parameters
    ----------
    known : (H, W) bool
        Texels whose value counts.
    labels : (H, W) int
        Chart of each texel, -1 in gutters. An unknown texel within a chart takes values from its own chart first,
        so that a wall behind a cupboard is not filled with what lies next to it in the map.
    smooth : int
        Times that what is grown is averaged over neighbours before: noise that is grown becomes streaks, which no
        denoiser takes for noise.
    """
    if not known.any():
        return np.zeros_like(values)
    h, w, channels = values.shape
    chart = np.pad(labels, 1, constant_values=-1).reshape(-1)
    grown = _Grown(np.pad(np.where(known[..., None], values, 0.0), ((1, 1), (1, 1), (0, 0))), np.pad(known, 1))
    for _ in range(smooth):
        grown.smooth(chart)
    while grown.ring(chart):
        pass
    for _ in range(RINGS):
        grown.ring(None)
    filled = grown.values.reshape(h + 2, w + 2, channels)[1:-1, 1:-1]
    left = ~grown.known.reshape(h + 2, w + 2)[1:-1, 1:-1]
    filled[left] = values[known].mean(axis=0)
    return np.where(known[..., None], values, filled)


class _Grown:
    """A map with a border of one, as flat arrays, that grows ring by ring from its known texels."""

    def __init__(self, values: Array, known: Mask) -> None:
        height, width = known.shape
        self.values, self.known = values.reshape(height * width, -1), known.reshape(-1).copy()
        self.steps = np.array([r * width + c for r in (-1, 0, 1) for c in (-1, 0, 1) if (r, c) != (0, 0)])
        self.inner = np.zeros((height, width), bool)
        self.inner[1:-1, 1:-1] = True
        self.inner = self.inner.reshape(-1)

    def smooth(self, chart: NDArray[np.integer]) -> None:
        """Every known texel takes the mean of itself and the known texels of its chart around it."""
        target = np.flatnonzero(self.known)
        total, count = self.values[target], np.ones(len(target))
        for step in self.steps:
            near = target + step
            same = self.known[near] & (chart[near] == chart[target])
            total += self.values[near] * same[:, None]
            count += same
        self.values[target] = total / count[:, None]

    def ring(self, chart: NDArray[np.integer] | None) -> bool:
        """Unknown texels next to known ones (of their own chart, where charts are given) take the mean of those."""
        target = np.flatnonzero(self.inner & ~self.known & (True if chart is None else chart >= 0))
        near = target[:, None] + self.steps
        counts = self.known[near]
        if chart is not None:
            counts &= chart[near] == chart[target][:, None]
        new = counts.any(axis=1)
        near, counts, target = near[new], counts[new], target[new]
        total = (self.values[near] * counts[..., None]).sum(axis=1)
        self.values[target] = total / counts.sum(axis=1)[:, None]
        self.known[target] = True
        return bool(len(target))


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
