"""Groups of nearby faces, for merged charts that take few texels of the light map.

A group costs the texels of its bounding rectangle, in the best of several rotations, plus MIXED texels per texel of its
surface and of its depth, because its faces share texels if one lies behind another.
"""

from __future__ import annotations

import numba
import numpy as np

from lambent.core.arrays import Floats, Indices

LONGEST = 24.0  # texels: a group with a longer side is halved even if that costs slightly more...
TRIED = 1.03  # ...up to this factor, because further halving may cost less
MANY = 4096  # faces above which a group's cost is estimated without rotation: it will be halved anyway
FEWEST = 4.0  # least number of texels of a chart
MIXED = 0.1  # cost of one texel with faces mixed over a depth of one texel


def clusters_of(corners: Floats, areas: Floats, size_m: Floats, depth: int, turns: Floats) -> list[Indices]:
    """Face numbers (F,) in groups, each halved as long as that lowers the cost.

    Parameters
    ----------
    corners : (F, 3, 3) of the faces, in metres.
    areas, size_m : (F,) areas of the faces in m^2, and their texel sizes in metres.
    depth : the axis along which they are projected.
    turns : (N, 2, 2) rotations to try, applied from the right, the first being none.
    """
    flat = np.ascontiguousarray(np.delete(corners, depth, axis=2))
    depths = np.ascontiguousarray(corners[:, :, depth])
    middles = (corners.min(axis=1) + corners.max(axis=1)) / 2
    order, ends = _halved(flat, depths, middles, areas, size_m, np.ascontiguousarray(turns))
    return np.split(order, ends[:-1])


@numba.njit(cache=True)
def _cost(
    flat: Floats, depths: Floats, areas: Floats, size_m: Floats, turns: Floats, mine: Indices
) -> tuple[float, float]:
    """A group's cost in texels, and its longer side without rotation."""
    area = weighted = plain = 0.0
    for face in mine:
        area += areas[face]
        weighted += areas[face] * size_m[face]
        plain += size_m[face]
    size = weighted / area if area > 0 else plain / len(mine)
    near, far = np.inf, -np.inf
    for face in mine:
        for corner in range(3):
            near, far = min(near, depths[face, corner]), max(far, depths[face, corner])
    least = longer = np.inf
    for t in range(len(turns) if len(mine) < MANY else 1):
        low_x, high_x, low_y, high_y = np.inf, -np.inf, np.inf, -np.inf
        for face in mine:
            for corner in range(3):
                u, v = flat[face, corner]
                x, y = u * turns[t, 0, 0] + v * turns[t, 1, 0], u * turns[t, 0, 1] + v * turns[t, 1, 1]
                low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
        wide, high = (high_x - low_x) / size, (high_y - low_y) / size
        least = min(least, (max(wide, 1.0) + 1) * (max(high, 1.0) + 1))
        if t == 0:
            longer = max(wide, high)
    return least + MIXED * area / size**2 * (far - near) / size, longer


@numba.njit(cache=True)
def _halved(
    flat: Floats, depths: Floats, middles: Floats, areas: Floats, size_m: Floats, turns: Floats
) -> tuple[Indices, Indices]:
    """All faces (F,) group by group, and the end of each group."""
    count = len(areas)
    order, kept, ends, done = np.arange(count), np.empty(count, np.int64), [0][:0], 0
    price, side = _cost(flat, depths, areas, size_m, turns, order)
    left = [(0, count, price, side)]
    while left:
        first, end, price, side = left.pop()
        mine = order[first:end]
        best, cut, axis_of, sides = np.inf, 0.0, -1, (0.0, 0.0, 0.0, 0.0)
        for axis in range(3 if price > 2 * FEWEST else 0):
            low, high = np.inf, -np.inf
            for face in mine:
                low, high = min(low, middles[face, axis]), max(high, middles[face, axis])
            middle = (low + high) / 2
            lower = middles[mine, axis] < middle
            if not lower.any() or lower.all():
                continue
            price_a, side_a = _cost(flat, depths, areas, size_m, turns, mine[lower])
            price_b, side_b = _cost(flat, depths, areas, size_m, turns, mine[~lower])
            if price_a + price_b < best:
                best, cut, axis_of, sides = price_a + price_b, middle, axis, (price_a, side_a, price_b, side_b)
        if axis_of >= 0 and best < (TRIED * price if side > LONGEST else price):
            lower = middles[mine, axis_of] < cut
            halves = np.concatenate((mine[lower], mine[~lower]))
            split = first + lower.sum()
            order[first:end] = halves
            left.append((first, split, sides[0], sides[1]))
            left.append((split, end, sides[2], sides[3]))
        else:
            kept[done : done + end - first] = mine
            done += end - first
            ends.append(done)
    return kept, np.array(ends)
