"""The points of a curve for a plot, and ranges that fit it."""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats
from lambent.materials.factored.curve import angles_rad
from lambent.viewer.modes.edit.curves.axes import END_DEG, Axis

BUCKETS = 256  # buckets of a line, two points each
ANGLES_DEG = np.degrees(angles_rad())
ANGLES_DEG.flags.writeable = False
SAME = 1e-12  # largest difference of equal channels, as a share of the largest value
FEATURE = 0.002  # share of a curve's span that counts as a change
DECADES = 6.0  # most decades below the largest value on a logarithmic axis


def decimated(values: Floats, low_deg: float, high_deg: float) -> tuple[Floats, Floats]:
    """Angles in degrees and values of at most 2 BUCKETS + 2 points of one channel (KNOTS + 1,) within a range.

    Every bucket keeps its smallest and its largest value, so that no peak is lost; one knot beyond each end is kept.
    """
    first = max(int(np.searchsorted(ANGLES_DEG, low_deg)) - 1, 0)
    last = min(int(np.searchsorted(ANGLES_DEG, high_deg, "right")), len(ANGLES_DEG) - 1)
    x, y = ANGLES_DEG[first : last + 1], values[first : last + 1]
    inner = len(x) - 2
    if inner <= 2 * BUCKETS:
        return x.copy(), np.ascontiguousarray(y)
    per = -(-inner // BUCKETS)
    whole = inner // per * per
    blocks = y[1 : 1 + whole].reshape(-1, per)
    starts = 1 + per * np.arange(len(blocks))
    chosen = np.concatenate([[0], starts + blocks.argmin(axis=1), starts + blocks.argmax(axis=1)])
    rest = np.arange(1 + whole, len(x) - 1)
    if len(rest):
        chosen = np.append(chosen, rest[[y[rest].argmin(), y[rest].argmax()]])
    chosen = np.unique(np.append(chosen, len(x) - 1))
    return x[chosen], np.ascontiguousarray(y[chosen])


def is_grey(values: Floats) -> bool:
    """Whether the three channels of a curve (KNOTS + 1, 3) are the same."""
    return bool(np.ptp(values, axis=1).max() <= SAME * max(float(values.max()), 1e-300))


def feature_deg(values: Floats) -> float:
    """Angle in degrees beyond which a curve hardly changes; 90 for a constant curve."""
    mean = values.mean(axis=1)
    changed = np.flatnonzero(np.abs(mean - mean[-1]) > FEATURE * np.ptp(mean)) if np.ptp(mean) > 0 else np.empty(0, int)
    return float(ANGLES_DEG[min(changed[-1] + 1, len(mean) - 1)]) if len(changed) else END_DEG


def fitted_x(values: Floats) -> Axis:
    """Range of angles in which a curve changes: all, except for a narrow peak at 0."""
    end = 1.4 * feature_deg(values)
    return Axis(0.0, max(end, 1.0) if end < 45.0 else END_DEG)


def fitted_y(values: Floats, x: Axis, log: bool) -> Axis:
    """Range of values of a curve (KNOTS + 1, 3) within a range of angles, with a margin above."""
    seen = values[(x.low <= ANGLES_DEG) & (x.high >= ANGLES_DEG)]
    top = float(seen.max()) if len(seen) else 0.0
    if top <= 1e-30:
        return Axis(1e-3, 1.0, True) if log else Axis(0.0, 1.0)
    if not log:
        return Axis(0.0, 1.25 * top)
    least = float(seen[seen > 0].min())
    return Axis(min(max(least / 2, top * 10**-DECADES), top / 10), 5 * top, True)
