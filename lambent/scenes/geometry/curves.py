"""Smooth curves through points: for profiles, tubes and camera paths."""

from __future__ import annotations

import numpy as np

from lambent.core.geometry.directions import Floats


def catmull_rom(points: Floats, t: Floats, closed: bool = False, knots: Floats | None = None) -> tuple[Floats, Floats]:
    """Position and derivative (N, D) at parameters t (N,) of the Catmull-Rom curve through `points` (K, D).

    The curve passes point k at t = knots[k], by default k (Catmull & Rom 1974). An open curve ends straight; a closed
    one returns to its first point a step of 1 after the last.
    """
    if knots is None:
        knots = np.arange(len(points), dtype=float)
    if closed:
        points = np.concatenate([points, points[:1]])
        knots = np.append(knots, knots[-1] + 1)
    step = np.diff(knots)[:, None]
    slope = np.diff(points, axis=0) / step
    if closed:
        before, after = np.concatenate([slope[-1:], slope]), np.concatenate([slope, slope[:1]])
        d0, d1 = np.concatenate([step[-1:], step]), np.concatenate([step, step[:1]])
    else:
        before, after = np.concatenate([slope[:1], slope]), np.concatenate([slope, slope[-1:]])
        d0, d1 = np.concatenate([step[:1], step]), np.concatenate([step, step[-1:]])
    tangents = (before * d1 + after * d0) / (d0 + d1)
    k = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, len(step) - 1)
    d = step[k]
    s = (t[:, None] - knots[k][:, None]) / d
    p0, p1, m0, m1 = points[k], points[k + 1], d * tangents[k], d * tangents[k + 1]
    a, b = 2 * (p0 - p1) + m0 + m1, 3 * (p1 - p0) - 2 * m0 - m1
    return p0 + s * (m0 + s * (b + s * a)), (m0 + s * (2 * b + 3 * s * a)) / d


def centripetal_knots(points: Floats) -> Floats:
    """Knots (K,) that keep a curve through unevenly spaced points free of loops (Yuksel et al. 2011).

    Steps grow with the square root of the distance, and are at least a quarter of their mean, so that coincident points
    take a finite time.
    """
    root = np.sqrt(np.linalg.norm(np.diff(points, axis=0), axis=-1))
    mean = float(root.mean()) or 1.0
    return np.concatenate([[0.0], np.cumsum(np.maximum(root, mean / 4))])


def smooth_curve(points: Floats, steps: int, closed: bool = False) -> tuple[Floats, Floats]:
    """Positions and derivatives at `steps` equal parameter steps between neighbours, ends included."""
    count = len(points) if closed else len(points) - 1
    return catmull_rom(points, np.linspace(0, count, count * steps + 1), closed)
