"""The surface within a texel of the light map: areas, and points spread over them.

A cell is an axis-aligned square of the map; of each triangle that crosses it, the part inside counts. Points are placed
by inverting that part's distribution over x, then over y at that x: equal shares of the unit square become equal shares
of its area, and neighbours stay neighbours, which preserves stratification.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baking.running.tiles import slices
from lambent.core.arrays import Floats, Indices, ranges
from lambent.core.geometry.triangles import cross_2d, triangle_areas

CANDIDATES_AT_ONCE = 1 << 20  # (triangle, texel) pairs tested at a time: about 200 MB
PLACED_AT_ONCE = 1 << 16
FLAT = 1e-12  # texels: an edge with a smaller extent in x counts as vertical


@dataclass(frozen=True)
class Pieces:
    """Parts of triangles in cells, sorted by cell: cell (N,), face (N,), area (N,) in m^2."""

    cell: Indices
    face: Indices
    area: Floats


def corners_of(geometry: dict[str, Floats], width: int, height: int) -> Floats:
    """Corners of the triangles on the light map, (T, 3, 2) float64 in texels; `geometry` as in `atlas.merged`."""
    return np.asarray(geometry["uv2"][geometry["faces"]].astype(np.float64) * (width, height))


def density_of(geometry: dict[str, Floats], corners: Floats) -> Floats:
    """Square metres per texel (T,) of triangles, 0 for one without area in the map."""
    world = triangle_areas(geometry["positions"][geometry["faces"]].astype(float))
    in_map = np.abs(cross_2d(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])) / 2
    return np.divide(world, in_map, out=np.zeros(len(world)), where=in_map > 0)


def pieces_of(geometry: dict[str, Floats], width: int, height: int, *, reach: float = 0.0) -> Pieces:
    """Parts of all triangles in all texels, or in cells enlarged by `reach` texels on every side.

    `geometry` is as in `atlas.merged`; the map has `width` x `height` texels.
    """
    corners = corners_of(geometry, width, height)
    density = density_of(geometry, corners)
    found: list[tuple[NDArray[Any], ...]] = [(np.zeros(0, int), np.zeros(0, int), np.zeros(0), np.zeros(0))]
    for face, x, y in _pairs(corners, width, height, reach):
        cell = y * width + x
        local = in_cell(corners[face], x, y, reach)
        area = _overlap(local) * (1 + 2 * reach) ** 2 * density[face]
        there = area > 0
        found.append((cell[there], face[there], area[there], local[there].mean(axis=1)[:, 0]))
    cell, face, area, middle = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.lexsort((face, middle, cell))
    return Pieces(cell[order], face[order], area[order])


def texel_areas(geometry: dict[str, Floats], width: int, height: int) -> Floats:
    """(H, W) float64: surface area in m^2 in each texel's square; `geometry` as in `atlas.merged`."""
    pieces = pieces_of(geometry, width, height)
    return np.asarray(np.bincount(pieces.cell, pieces.area, minlength=width * height).reshape(height, width))


def in_cell(triangles: Floats, x: Indices, y: Indices, reach: float) -> Floats:
    """Triangles (n, 3, 2) in texels, transformed so that their cell is the unit square."""
    return np.asarray((triangles - np.stack([x, y], axis=-1)[:, None] + reach) / (1 + 2 * reach))


def _pairs(corners: Floats, width: int, height: int, reach: float) -> Iterator[tuple[Indices, Indices, Indices]]:
    """Yield triangles with the texels (column, row) whose cells they may cross, in batches."""
    low = np.floor(corners.min(axis=1) - reach).astype(int).clip(0, (width - 1, height - 1))
    high = np.floor(corners.max(axis=1) + reach).astype(int).clip(0, (width - 1, height - 1))
    counts = high - low + 1
    pairs = counts[:, 0] * counts[:, 1]
    start = 0
    while start < len(corners):
        stop = start + max(1, int(np.searchsorted(np.cumsum(pairs[start:]), CANDIDATES_AT_ONCE, side="right")))
        face = np.repeat(np.arange(start, min(stop, len(corners))), pairs[start:stop])
        number = ranges(pairs[start:stop])
        yield face, low[face, 0] + number % counts[face, 0], low[face, 1] + number // counts[face, 0]
        start = stop


def _overlap(triangles: Floats) -> Floats:
    """Area (n,) of triangles (n, 3, 2) within the unit square, by Green's theorem.

    Each edge contributes the signed integral over x in [0, 1] of its height, clamped to [0, 1].
    """
    total = np.zeros(len(triangles))
    for i in range(3):
        start, end = triangles[:, i], triangles[:, (i + 1) % 3]
        run, rise = (end - start).T
        slope = np.divide(rise, run, out=np.zeros(len(run)), where=np.abs(run) > FLAT)
        from_x, to_x = start[:, 0].clip(0, 1), end[:, 0].clip(0, 1)
        from_y, to_y = (start[:, 1] + slope * (x - start[:, 0]) for x in (from_x, to_x))
        climb = to_y - from_y
        flat = np.abs(climb) < 1e-6
        mean = np.divide(_integral(to_y) - _integral(from_y), climb, out=np.zeros(len(run)), where=~flat)
        total += np.where(flat, ((from_y + to_y) / 2).clip(0, 1), mean) * (to_x - from_x)
    return np.abs(total)


def _integral(y: Floats) -> Floats:
    """Integral of y clamped to [0, 1]."""
    return np.where(y <= 0, 0.0, np.where(y >= 1, y - 0.5, y * y / 2))


def placed(triangles: Floats, u: Floats) -> Floats:
    """Points (n, 2) in the part of triangles (n, 3, 2) within the unit square, uniform by area if u (n, 2) is uniform.

    u is in [0, 1]^2. A triangle that only touches the square gives a point on its border.
    """
    found = np.zeros((len(triangles), 2))
    for mine in slices(len(triangles), PLACED_AT_ONCE):
        found[mine] = _placed(triangles[mine], u[mine])
    return found


def _placed(triangles: Floats, u: Floats) -> Floats:
    """Between breaks, the part's height is linear in x, and its integral can be inverted."""
    breaks = _breaks(triangles)
    low, high = _extent(triangles, breaks)
    height, rows = high - low, np.arange(len(breaks))
    step = np.diff(breaks, axis=1)
    cumulated = np.cumsum((height[:, :-1] + height[:, 1:]) / 2 * step, axis=1)
    target = u[:, 0] * cumulated[:, -1]
    slab = np.argmax(cumulated >= target[:, None], axis=1)
    left = target - np.where(slab > 0, cumulated[rows, slab - 1], 0.0)
    h0, h1, run = height[rows, slab], height[rows, slab + 1], step[rows, slab]
    share = np.divide(left, run, out=np.zeros(len(run)), where=run > 0)
    root = h0 + np.sqrt(np.maximum(h0**2 + 2 * (h1 - h0) * share, 0))
    t = np.divide(2 * share, root, out=np.full(len(run), 0.5), where=root > 0).clip(0, 1)
    bottom, top = (side[rows, slab] * (1 - t) + side[rows, slab + 1] * t for side in (low, high))
    return np.stack([breaks[rows, slab] + t * run, bottom + u[:, 1] * (top - bottom)], axis=-1)


def _breaks(triangles: Floats) -> Floats:
    """(n, 11) sorted x between which the borders of the part in the unit square are straight."""
    ends = triangles[..., 0].min(axis=1).clip(0, 1), triangles[..., 0].max(axis=1).clip(0, 1)
    found = [*ends, *triangles[..., 0].T]
    for i in range(3):
        start, end = triangles[:, i], triangles[:, (i + 1) % 3]
        run, rise = (end - start).T
        for level in (0.0, 1.0):
            t = np.divide(level - start[:, 1], rise, out=np.zeros(len(rise)), where=rise != 0).clip(0, 1)
            found.append(start[:, 0] + t * run)
    return np.sort(np.stack(found, axis=1).clip(ends[0][:, None], ends[1][:, None]), axis=1)


def _extent(triangles: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Lowest and highest y of triangles (n, 3, 2) at x (n, m), clamped to [0, 1]; both (n, m)."""
    low, high = np.full(x.shape, np.inf), np.full(x.shape, -np.inf)
    for i in range(3):
        start, end = triangles[:, None, i], triangles[:, None, (i + 1) % 3]
        run = end[..., 0] - start[..., 0]
        upright = np.abs(run) <= FLAT
        t = np.divide(x - start[..., 0], run, out=np.zeros_like(x), where=~upright & (run != 0))
        crossed = (t >= -FLAT) & (t <= 1 + FLAT) & (~upright | (np.abs(x - start[..., 0]) <= FLAT))
        t = t.clip(0, 1)
        for y in (start[..., 1] + t * (end[..., 1] - start[..., 1]), np.where(upright, end[..., 1], np.nan)):
            there = crossed & ~np.isnan(y)
            low = np.where(there, np.fmin(low, y), low)
            high = np.where(there, np.fmax(high, y), high)
    empty = low > high  # by rounding, at the very tip
    low, high = np.where(empty, 0.0, low).clip(0, 1), np.where(empty, 0.0, high).clip(0, 1)
    return low, high
