"""Smooth curves through points: for profiles, tubes and the ways of cameras."""

from __future__ import annotations

import numpy as np

from lambent.core.frames import Floats


def catmull_rom(points: Floats, t: Floats, closed: bool = False) -> tuple[Floats, Floats]:
    """Position and derivative (N, D) at parameters t (N,) of the Catmull-Rom curve through `points` (K, D).

    Point k is passed at t = k (Catmull & Rom 1974, uniform knots). An open curve's end points are mirrored, so that
    it ends straight; a closed one comes back to its first point at t = K.
    """
    count = len(points) if closed else len(points) - 1
    if closed:
        padded = np.concatenate([points[-1:], points, points[:2]])
    else:
        padded = np.concatenate([2 * points[:1] - points[1:2], points, 2 * points[-1:] - points[-2:-1]])
    k = np.clip(np.floor(t).astype(int), 0, count - 1)
    s = (t - k)[:, None]
    p0, p1, p2, p3 = (padded[k + i] for i in range(4))
    a, b, c = 2 * p0 - 5 * p1 + 4 * p2 - p3, 3 * p1 - p0 - 3 * p2 + p3, p2 - p0
    return p1 + 0.5 * s * (c + s * (a + s * b)), 0.5 * (c + s * (2 * a + s * 3 * b))


def smooth_curve(points: Floats, steps: int, closed: bool = False) -> tuple[Floats, Floats]:
    """Positions and derivatives at `steps` equal parameter steps between neighbours, ends included."""
    count = len(points) if closed else len(points) - 1
    return catmull_rom(points, np.linspace(0, count, count * steps + 1), closed)
