"""Regions of a curve on its plot: presets, handles, and which one is under the mouse."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.editing.curves.operators import Region
from lambent.viewer.modes.edit.curves.axes import END_DEG, Axes, Axis
from lambent.viewer.modes.edit.curves.lines import ANGLES_DEG

Edge = Literal["a", "b", "c", "d"]
Grip = Literal["a", "b", "c", "d", "bar", "curve"]
EDGES: tuple[Edge, ...] = ("a", "b", "c", "d")
PAIRS: tuple[tuple[Edge, Edge], ...] = (("b", "c"), ("a", "d"))  # handles at the top and at the bottom of the plot
MEANINGS = {
    "a": "the edit starts here",
    "b": "full strength starts here",
    "c": "full strength ends here",
    "d": "the edit ends here",
}
GAP_DEG = 0.05  # shortest ramp
LIMITS = {  # the ends of ramps may lie outside of the curve
    "a": (-END_DEG, END_DEG - GAP_DEG),
    "b": (0.0, END_DEG),
    "c": (0.0, END_DEG),
    "d": (GAP_DEG, 2 * END_DEG),
}
FLAG_PX, STRIP_PX = 10.0, 14.0  # width of a handle; height of the strips that hold them
_GAPS = (GAP_DEG, 0.0, GAP_DEG)  # least distances from a to b, b to c, c to d


def region_of(a: float, b: float, c: float, d: float) -> Region:
    """The region of four angles in degrees."""
    return Region(**dict(zip(EDGES, np.radians((a, b, c, d)).tolist(), strict=True)))


def edges_deg(region: Region) -> tuple[float, float, float, float]:
    """a, b, c, d in degrees."""
    a, b, c, d = np.degrees((region.a, region.b, region.c, region.d)).tolist()
    return a, b, c, d


def with_edge(region: Region, edge: Edge, angle_deg: float) -> Region:
    """Move an edge, which pushes other edges along instead of crossing them."""
    edges, index = list(edges_deg(region)), EDGES.index(edge)
    low, high = LIMITS[edge]
    edges[index] = min(max(angle_deg, low), high)
    for above in range(index + 1, 4):
        edges[above] = max(edges[above], edges[above - 1] + _GAPS[above - 1])
    for below in range(index - 1, -1, -1):
        edges[below] = min(edges[below], edges[below + 1] - _GAPS[below])
    return region_of(*edges)


def moved(region: Region, by_deg: float) -> Region:
    """Move all four edges, as far as b and c stay within the curve."""
    a, b, c, d = edges_deg(region)
    by = min(max(by_deg, -b), END_DEG - c) if b >= 0 and c <= END_DEG else 0.0
    return region_of(a + by, b + by, c + by, d + by)


def spanned(begin_deg: float, end_deg: float) -> Region | None:
    """Full strength between two angles, with ramps half as wide; None if they are too close."""
    b, c = sorted((begin_deg, end_deg))
    ramp = max((c - b) / 2, GAP_DEG)
    return region_of(b - ramp, b, c, c + ramp) if c - b > GAP_DEG else None


def whole() -> Region:
    return region_of(-10.0, 0.0, END_DEG, END_DEG + 10)


def shown(axis: Axis) -> Region:
    """The middle of the plot's range."""
    step = (axis.high - axis.low) / 4
    return region_of(axis.low, axis.low + step, axis.high - step, axis.high)


def peak(values: Floats) -> Region | None:
    """Region around the peak of a curve (KNOTS + 1, 3): b and c at 1/2, a and d at 1/10; None for a flat one."""
    mean = values.mean(axis=1)
    least, span = float(mean.min()), float(np.ptp(mean))
    if span <= 1e-9 * float(mean.max()):
        return None
    top = int(mean.argmax())
    (b, c), (a, d) = (_run_about(mean >= least + share * span, top) for share in (0.5, 0.1))
    ramp = max(c - b, 1.0)
    begin = min(a, b - GAP_DEG) if b > 0 else -ramp
    return region_of(begin, b, c, max(d, c + GAP_DEG) if c < END_DEG else END_DEG + ramp)


def tail(values: Floats) -> Region | None:
    """Region from the angle at which a curve has fallen by 9/10 of its range; None if it does not fall so far."""
    mean = values.mean(axis=1)
    least, span = float(mean.min()), float(np.ptp(mean))
    top = int(mean.argmax())
    low = top + np.flatnonzero(mean[top:] < least + 0.1 * span)
    half = top + np.flatnonzero(mean[top:] < least + 0.5 * span)
    if span <= 1e-9 * float(mean.max()) or not len(low) or ANGLES_DEG[low[0]] > END_DEG - 1:
        return None
    b = float(ANGLES_DEG[low[0]])
    return region_of(min(float(ANGLES_DEG[half[0]]), b - GAP_DEG), b, END_DEG, END_DEG + 10)


def first(values: Floats) -> Region:
    """The first region of a curve: its peak, or the middle."""
    return peak(values) or region_of(20.0, 35.0, 55.0, 70.0)


def flags_px(region: Region, axes: Axes) -> dict[Edge, tuple[float, float]]:
    """Left and right of each handle in pixels: a and b point to the left of their angle, c and d to the right.

    Handles of angles outside of the plot are drawn at its edge, so that all four can be grabbed.
    """
    left, right = axes.place.x, axes.place.x + axes.place.width
    x = {edge: axes.pixel(angle, 1.0)[0] for edge, angle in zip(EDGES, edges_deg(region), strict=True)}
    placed: dict[Edge, tuple[float, float]] = {}
    for low, high in PAIRS:
        at = min(max(x[low], left + FLAG_PX), right - FLAG_PX)
        to = max(min(max(x[high], left), right - FLAG_PX), at)
        placed[low], placed[high] = (at - FLAG_PX, at), (to, to + FLAG_PX)
    return placed


def grip_at(region: Region, axes: Axes, x: float, y: float) -> Grip | None:
    """The grip at a pixel: b, c and the bar between them at the top, a and d at the bottom, or the curve."""
    top, bottom = axes.place.y, axes.place.y + axes.place.height
    if not (axes.place.x <= x <= axes.place.x + axes.place.width and top <= y <= bottom):
        return None
    flags = flags_px(region, axes)
    for strip, edges in zip((top, bottom - STRIP_PX), PAIRS, strict=True):
        for edge in edges if strip <= y <= strip + STRIP_PX else ():
            if flags[edge][0] - 2 <= x <= flags[edge][1] + 2:
                return edge
    if y <= top + STRIP_PX and flags["b"][1] < x < flags["c"][0]:
        return "bar"
    angle = np.radians(axes.at(x, y)[0])
    return "curve" if region.a < angle < region.d else None


def _run_about(above: NDArray[np.bool_], at: int) -> tuple[float, float]:
    """First and last angle in degrees of the run about knot `at`."""
    below = np.flatnonzero(~above)
    before, after = below[below < at], below[below > at]
    low, high = before[-1] + 1 if len(before) else 0, after[0] - 1 if len(after) else len(above) - 1
    return float(ANGLES_DEG[low]), float(ANGLES_DEG[high])
