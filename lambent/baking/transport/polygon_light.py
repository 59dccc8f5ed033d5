"""Light of a wide triangle, integrated over its part above the surface; a point light would be too coarse."""

from __future__ import annotations

from typing import Any

from lambent.materials.lobes import Vector, dot

LEAST = 1e-30  # keeps quotients of degenerate shapes finite


def cosine_integral(a: Vector, b: Vector, c: Vector, ops: Any) -> Any:
    """Integral of cos(theta) over the solid angle of a triangle above the horizon z = 0, in sr.

    Lambert's formula for polygons (Lambert 1760; Baum et al. 1989, eq. 1): half the sum over the edges of each edge's
    angle times z of its plane's unit normal. Parts below the horizon are replaced by the arc between the points where
    edges cross it. Corners are relative to the origin, of any length but 0. In single precision the error is 1e-7 sr:
    for a small triangle, use solid angle times cosine.
    """
    total: Any = 0.0
    falls_x, falls_y, rises_x, rises_y = (0.0 * a[2] for _ in range(4))
    for start, end in ((a, b), (b, c), (c, a)):
        fall, height = start[2] - end[2], start[2]
        crosses = (height < 0) != (end[2] < 0)
        share = ops.select(crosses, height, 0.0) / ops.select(crosses, fall, 1.0)
        x, y = (s + share * (e - s) for s, e in zip(start[:2], end[:2], strict=True))
        falls, rises = crosses & (fall > 0), crosses & (fall < 0)
        falls_x, falls_y = (ops.select(falls, new, old) for new, old in ((x, falls_x), (y, falls_y)))
        rises_x, rises_y = (ops.select(rises, new, old) for new, old in ((x, rises_x), (y, rises_y)))
        u = tuple(ops.select(rises, new, old) for new, old in zip((x, y, 0.0), start, strict=True))
        v = tuple(ops.select(falls, new, old) for new, old in zip((x, y, 0.0), end, strict=True))
        normal = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
        length = ops.sqrt(dot(normal, normal))
        turn = normal[2] / ops.maximum(length, LEAST) * ops.atan2(length, dot(u, v))
        total = total + ops.select((u[2] < 0) | (v[2] < 0), 0.0, turn)
    along = ops.atan2(falls_x * rises_y - falls_y * rises_x, falls_x * rises_x + falls_y * rises_y)
    return ops.abs(total + along) / 2


def highest_part(centre: Any, corners: Any, n: Any, ops: Any) -> Any:
    """A point of a triangle above a surface with normal n, if there is one: its centre, or closer to the corners above.

    Positions are vectors (dr) relative to the surface point.
    """
    heights = [ops.maximum(dot(corner, n), 0.0) for corner in corners]
    total = sum(heights)
    place = sum(corner * height for corner, height in zip(corners, heights, strict=True))
    low = (dot(centre, n) <= 0) & (total > 0)
    return ops.select(low, place / ops.select(total > 0, total, 1.0), centre)
