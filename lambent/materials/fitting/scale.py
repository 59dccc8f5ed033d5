"""The linear coefficient of a lobe (ks, kt) or of a diffuse term, solved for instead of searched.

For a candidate shape the model is background + k basis: one unknown per channel. Under L1 a weighted median is the
exact minimiser; under the squared metrics Gauss-Newton steps in log k start from the linear solution.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.materials.measured.inspecting.metrics import Metric

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
