"""The diffuse coefficient from the mode of the measured values (thesis 3.4.1)."""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats

BIN = 0.02  # bin width in ln f: finer than the 2 % noise of a good gonio-photometer
SMOOTH_BINS = 3.0  # standard deviation of the smoothing, in bins, so that noise does not split the peak
FLOOR = 1e-4 / np.pi  # f of a diffuse coefficient of 1e-4; smaller values count as 0
FLOOR_SHARE = 0.2  # of the mode's density: the most allowed below the mode (table noise, a gonio-photometer's dark rim)
LOWEST_SHARE = 0.25  # the mode is sought among the lowest quarter of the values, see `diffuse_mode`


def diffuse_mode(f: Floats, weight: Floats) -> float:
    """kd (dimensionless) of one channel: pi times the most frequent value over the measured directions.

    The histogram is over ln f, because values span five decades with relative noise; tuples are weighted, so that a
    table sampled densely around its peak gives the same mode as a uniform one. Lobes only add to the diffuse term, so
    at most `LOWEST_SHARE` of the weight may lie below the mode; this excludes the plateau of a wide lobe. If more than
    that share scatters nothing, kd is 0; fewer zeros (a channel clipped at the edge of the gamut, sensor noise) do not
    affect the mode. The density must fall off below the mode (`_is_floor`), otherwise kd is 0: values of a lobe without
    a diffuse term are spread evenly over ln f.
    Parameters
    ----------
    f : (N,)
        Measured BSDF in 1/sr, >= 0.
    weight : (N,)
        Solid angle times |cos theta_o|: grazing values are the noisiest.
    """
    if len(f) == 0 or weight.sum() <= 0:
        return 0.0
    weight = weight / weight.sum()
    lit = f > FLOOR
    dark_share = 1 - float(weight[lit].sum())
    if dark_share > LOWEST_SHARE:
        return 0.0
    log_f, weight = np.log(f[lit] / FLOOR), weight[lit]
    bins = np.floor(log_f / BIN).astype(np.int64)
    share: Floats = np.bincount(bins, weights=weight).astype(np.float64)
    reach = int(4 * SMOOTH_BINS)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / SMOOTH_BINS) ** 2)
    density = np.convolve(share, kernel / kernel.sum())[reach : reach + len(share)]
    below = dark_share + np.concatenate([np.zeros(reach + 1), np.cumsum(share)])[: len(share)]  # excludes the peak
    mode = int(np.argmax(np.where(below <= LOWEST_SHARE, density, 0.0)))
    if not _is_floor(share, mode, float(density[mode])):
        return 0.0
    near = np.abs(bins - mode) <= 2 * SMOOTH_BINS
    return float(np.pi * FLOOR * np.exp(np.average(log_f[near], weights=weight[near])))


def _is_floor(share: Floats, mode: int, peak: float) -> bool:
    """Whether the density is low one to two and a half units of ln f below the mode."""
    near, far = int(1 / BIN), int(2.5 / BIN)
    below = share[max(mode - far, 0) : max(mode - near, 0)].sum() / (far - near)
    return bool(below < FLOOR_SHARE * peak)
