"""Pieces of triangles, so small that angles are nearly linear in each, and the angles at their corners in order."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi

from lambent.bake.transport.overlaps import spread
from lambent.materials.factored.curve import END_RAD

BEND, BEND_BY_ANGLE, MOST_BEND = 0.25, 1 / 16, 2.0  # bands that an angle may be from linear within a piece; more, in
# proportion to the angle, where curves have no narrow peaks
WIDEST = 2  # bands that a piece may span in both of two curves
MOST_CUTS = 32  # an edge
Steps = Callable[[Any], list[Any]]


def in_bands(angle: Any, count: int) -> Any:
    """An angle in bands; the end of the last band where rounding puts 90 degrees beyond it."""
    step = angle * (count / END_RAD)
    return dr.select(step < count * (1 + 1e-5), dr.minimum(step, count), step)


def cuts_of(corners: list[Any], middles: list[Any]) -> Any:
    """Cuts of an edge after which the angles are nearly linear in each piece: their error falls with the square.

    Two angles that vary together in a piece are counted as if they did not (4.15), so one must vary little.
    """
    cuts = mi.Float(1)
    for at, between in zip(zip(*corners, strict=True), zip(*middles, strict=True), strict=True):
        bends = [dr.abs(m - (x + y) / 2) for m, x, y in zip(between, at, (*at[1:], at[0]), strict=True)]
        least = dr.minimum(dr.minimum(*at[:2]), at[2])
        allowed = dr.clip(least * BEND_BY_ANGLE, BEND, MOST_BEND)
        cuts = dr.maximum(cuts, dr.sqrt(dr.maximum(dr.maximum(*bends[:2]), bends[2]) / allowed))
    if len(corners[0]) == 2:
        spans = [
            dr.maximum(dr.maximum(x, y), z) - dr.minimum(dr.minimum(x, y), z) for x, y, z in zip(*corners, strict=True)
        ]
        cuts = dr.maximum(cuts, dr.minimum(*spans) / WIDEST)
    return dr.clip(mi.UInt32(dr.ceil(cuts)), 1, MOST_CUTS)


def piece(a: Any, b: Any, c: Any, n: Any, s: Any) -> list[Any]:
    """Corners, unit, of piece s of the n^2 equal pieces of a flat triangle, counted in rows from a."""
    row = mi.UInt32(dr.sqrt(mi.Float(s) + 0.5))
    k = s - row * row
    j, turned = k // 2, k % 2 == 1
    u, v = (b - a) / mi.Float(n), (c - b) / mi.Float(n)

    def at(i: Any, k: Any) -> Any:
        return dr.normalize(a + u * mi.Float(i) + v * mi.Float(k))

    second, third = at(row + 1, j), at(row + 1, j + 1)
    return [at(row, j), dr.select(turned, third, second), dr.select(turned, at(row, j + 1), third)]


def means(middles: list[list[Any]]) -> list[Any]:
    """Mean angles over a triangle, by curve: exact for angles that are quadratic in it."""
    return [(a + b + c) / 3 for a, b, c in zip(*middles, strict=True)]


def orders_of_piece(corners: list[Any], steps: Steps, counts: list[int]) -> list[Any]:
    """`orders` of a piece; for the mean the centre counts 3/4 (Simpson's rule on a triangle)."""
    centre, found = steps(dr.normalize(corners[0] + corners[1] + corners[2])), list(map(steps, corners))
    mean = [0.75 * at + (a + b + c) / 12 for at, a, b, c in zip(centre, *found, strict=True)]
    return orders(found, mean, counts)


def orders(corners: list[Any], means: list[Any], counts: list[int]) -> list[Any]:
    """The angles at a piece's corners in order, by curve, moved so that their mean is that of the whole piece.

    Angles are convex along most edges: without the correction they would be too large in the mean, and highlights too
    dark.
    """
    found = []
    for at, mean, end in zip(zip(*corners, strict=True), means, counts, strict=True):
        shift = mean - (at[0] + at[1] + at[2]) / 3
        a, b, c = (dr.clip(angle + shift, 0.0, dr.maximum(angle, end)) for angle in at)
        found.append(spread(a, b, c, dr))
    return found


def solid_angle(a: Any, b: Any, c: Any, across: Any) -> Any:
    """Of a triangle seen from the origin: corners, and (b - a) x (c - a) (van Oosterom and Strackee 1983, eq. 8).

    Computed from directions alone, the volume of a small lamp would be lost in rounding.
    """
    volume, x, y, z = dr.abs(dr.dot(a, across)), dr.norm(a), dr.norm(b), dr.norm(c)
    return 2 * dr.atan2(volume, x * y * z + dr.dot(a, b) * z + dr.dot(b, c) * x + dr.dot(c, a) * y)
