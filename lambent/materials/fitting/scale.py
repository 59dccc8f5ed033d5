"""Coefficients that are solved for instead of searched: of a lobe (ks, kt), and of a diffuse term.

For a candidate shape the model is background + k basis: one unknown per channel. Under L1 a weighted median is the
exact minimiser; under the squared metrics Gauss-Newton steps in log k start from the linear solution. A diffuse term
starts from the mode of the measured values (thesis 3.4.1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.materials.measured.inspecting.metrics import Metric

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


TINY = 1e-30
STEP_LIMIT = 1.5  # of ln k per Gauss-Newton step: far from the optimum the model is not linear in ln k


@dataclass(frozen=True)
class Channel:
    """Data of one channel, all (N,): f in 1/sr, and the metric's terms w and c."""

    measured: Floats
    background: Floats
    w: Floats
    c: Floats

    def at(self, chosen: Flags) -> Channel:
        return Channel(self.measured[chosen], self.background[chosen], self.w[chosen], self.c[chosen])


def weighted_median(values: Floats, weights: Floats) -> Floats:
    """Exact minimiser m (...) of sum_t weights_t |values_t - m| over the last axis; 0 if no weight is positive.

    Parameters
    ----------
    values, weights : (..., N)
        Weights are >= 0. Of an interval of minimisers, the lower end is returned.
    """
    if values.shape[-1] == 0:
        return np.zeros(values.shape[:-1], dtype=values.dtype)
    order = np.argsort(values, axis=-1)
    cumulated = np.cumsum(np.take_along_axis(weights, order, -1), axis=-1, dtype=np.float64)
    total = cumulated[..., -1:]
    at = np.argmax(cumulated >= total / 2, axis=-1)[..., None]
    median = np.take_along_axis(np.take_along_axis(values, order, -1), at, -1)
    return np.asarray(np.where(total > 0, median, 0)[..., 0])


def solve_scale(
    metric: Metric, channel: Channel, basis: Floats, limits: tuple[float, float] = (0.0, np.inf), steps: int = 5
) -> tuple[Floats, Floats]:
    """The best coefficient of each candidate basis, and its residual.

    Parameters
    ----------
    basis : (K, N)
        f in 1/sr of K candidates with coefficient 1.
    limits : (float, float)
        Interval the coefficient is clamped to; 0 <= lower.
    steps : int
        Gauss-Newton steps for the squared metrics; the search needs few, the final answer many.

    Returns
    -------
    k, total : (K,)
        The coefficient, and sum_t w |T(c measured) - T(c (background + k basis))|^power.
    """
    if limits[0] == limits[1]:
        k = np.full(len(basis), limits[0], dtype=basis.dtype)
    elif metric.power == 1:
        k = _median_scale(channel, basis)
    else:
        k = _least_squares_scale(metric, channel, basis, steps)
    k = np.clip(k, *limits)
    model = channel.c * (channel.background + k[:, None] * basis)
    difference = np.abs(metric.transform(channel.c * channel.measured) - metric.transform(model))
    return k, (difference if metric.power == 1 else difference * difference) @ channel.w


def solve_coefficients(
    metric: Metric, channels: Sequence[Channel], basis: Floats, limits: Sequence[tuple[float, float]], steps: int = 5
) -> Floats:
    """(C,) float64 coefficient of one basis (1, N) in every channel, within its limits; see `solve_scale`."""
    pairs = zip(channels, limits, strict=True)
    return np.array([solve_scale(metric, one, basis, interval, steps)[0][0] for one, interval in pairs], dtype=float)


def _median_scale(channel: Channel, basis: Floats) -> Floats:
    """argmin_k sum w c |r - k basis| is the median of r/basis with weights w c basis."""
    rest = channel.measured - channel.background
    ratio = np.divide(rest, basis, out=np.zeros_like(basis), where=basis > TINY)
    return weighted_median(ratio, np.where(basis > TINY, channel.w * channel.c * basis, 0))


def _least_squares_scale(metric: Metric, channel: Channel, basis: Floats, steps: int) -> Floats:
    w, c = channel.w, channel.c
    squares = np.maximum((basis * basis) @ (w * c * c), TINY)
    k = np.maximum((basis @ (w * c * c * (channel.measured - channel.background))) / squares, 0)
    if metric.linear:
        return np.asarray(k)
    k = np.maximum(k, 1e-9)
    target = metric.transform(c * channel.measured)
    for _ in range(steps):
        lobe = c * (k[:, None] * basis)
        x = c * channel.background + lobe
        derivative = metric.slope(x) * lobe  # dT / d ln k
        gradient = ((target - metric.transform(x)) * derivative) @ w
        step = gradient / np.maximum((derivative * derivative) @ w, TINY)
        k = k * np.exp(np.clip(step, -STEP_LIMIT, STEP_LIMIT))
    return k
