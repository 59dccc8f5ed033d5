"""The diffuse coefficient from the mode of the measured values (thesis 3.4.1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating]

BIN = 0.02  # bin width in ln f: finer than the 2 % noise of a good gonio-photometer
SMOOTH_BINS = 3.0  # standard deviation of the smoothing, in bins, so that noise does not split the peak
FLOOR = 1e-4 / np.pi  # f of a diffuse coefficient of 1e-4; what lies below counts as none
LOWEST_SHARE = 0.25  # the mode is sought among the lowest quarter of the values, see `diffuse_mode`


def diffuse_mode(f: Floats, weight: Floats) -> float:
    """kd (dimensionless) of one channel: pi times the value that most of the measured directions share.

    The histogram is over ln f, because values span five decades and noise is relative to them; tuples count by `weight`,
    so that a table sampled densely around its peak gives the same mode as an even one. Lobes only add to the diffuse
    term, so no more than `LOWEST_SHARE` of the weight may lie below the mode: the plateau of a wide lobe is not mistaken
    for it.

    Parameters
    ----------
    f : (N,)
        Measured BSDF in 1/sr, >= 0.
    weight : (N,)
        Solid angle times |cos theta_o|: grazing values are the noisiest.
    """
    if len(f) == 0 or weight.sum() <= 0:
        return 0.0
    log_f = np.log(np.maximum(f, FLOOR))
    bins = np.floor((log_f - np.log(FLOOR)) / BIN).astype(np.int64)
    share = np.bincount(bins, weights=weight / weight.sum())
    reach = int(4 * SMOOTH_BINS)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / SMOOTH_BINS) ** 2)
    density = np.convolve(share, kernel / kernel.sum())[reach : reach + len(share)]
    below = np.concatenate([[0.0], np.cumsum(share)[:-1]])
    peak_width = reach  # half of the peak itself lies below its centre and does not count
    below = np.concatenate([np.zeros(peak_width), below])[: len(below)]
    mode = int(np.argmax(np.where(below <= LOWEST_SHARE, density, 0.0)))
    if mode == 0:
        return 0.0
    near = np.abs(bins - mode) <= 2 * SMOOTH_BINS
    return float(np.pi * np.exp(np.average(log_f[near], weights=weight[near])))
