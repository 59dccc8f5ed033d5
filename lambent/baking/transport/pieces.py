"""Pieces of triangles small enough for angles to be nearly linear, and the angles at their corners."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any

import drjit as dr
import mitsuba as mi

from lambent.baking.transport.overlaps import spread
from lambent.materials.factored.curve import END_RAD

BEND, BEND_BY_ANGLE, MOST_BEND = 0.5, 1 / 8, 4.0  # deviation of an angle from linear within a piece, in bands; more, in
# proportion to the angle, where curves have no narrow peaks
WIDEST = 3  # nodes that a piece may span along both of two curves
COS_BROAD = 0.975  # between the corners of a piece of a wide light: corresponds to 13 degrees
MOST_CUTS, MOST_CUTS_OF_WIDE = 5, 10  # subdivisions of a triangle into four, and of a wide light's


def in_bands(angle: Any, count: int) -> Any:
    """An angle in units of bands; clamped to the last band if rounding puts 90 degrees beyond it."""
    step = angle * (count / END_RAD)
    return dr.select(step < count * (1 + 1e-5), dr.minimum(step, count), step)


def is_bent(corners: list[Any], middles: list[Any]) -> Any:
    """Whether a piece must be cut because its angles are not nearly linear: a cut reduces the error to a quarter.

    Of two angles, one is taken at its mean along the other (4.15 takes them as independent), so one must vary little.
    """
    bent = mi.Bool(False)
    for at, between in zip(zip(*corners, strict=True), zip(*middles, strict=True), strict=True):
        bends = [dr.abs(m - (x + y) / 2) for m, x, y in zip(between, at, (*at[1:], at[0]), strict=True)]
        bent |= _most(bends) > dr.clip(_least([*at, *between]) * BEND_BY_ANGLE, BEND, MOST_BEND)
    if len(corners[0]) == 2:
        bent |= dr.minimum(*(_most(x) - _least(x) for x in zip(*corners, strict=True))) > WIDEST
    return bent


def is_beyond(corners: list[Any], middles: list[Any], part: tuple[Any, Any]) -> Any:
    """Whether a piece, and all its subdivisions, meet no node of a part [begin, end) of the first curve.

    A quadratic angle leaves the range of its corners and midpoints by less than an edge's bend; the margin is twice the
    largest bend plus the width of a hat function.
    """
    at, between = [w[0] for w in corners], [w[0] for w in middles]
    bends = [dr.abs(m - (x + y) / 2) for m, x, y in zip(between, at, (*at[1:], at[0]), strict=True)]
    margin = 2 * _most(bends) + 2
    return (_most([*at, *between]) + margin < mi.Float(part[0])) | (
        _least([*at, *between]) - margin > mi.Float(part[1])
    )


def is_broad(corners: list[Any]) -> Any:
    """Whether a piece spans so many directions that its quotient may differ much from that at its centre."""
    a, b, c = corners
    return _least([dr.dot(a, b), dr.dot(b, c), dr.dot(c, a)]) < COS_BROAD


def above(w: Any, n: Any) -> Any:
    """Unit w, or, if it is below the horizon of n, the nearest direction on the horizon."""
    return dr.normalize(w - n * dr.minimum(dr.dot(w, n), 0.0))


def _most(values: Sequence[Any]) -> Any:
    return reduce(dr.maximum, values)


def _least(values: Sequence[Any]) -> Any:
    return reduce(dr.minimum, values)


# A piece of a triangle a, b, c: the number of subdivisions into four, the part chosen at each (2 bits, the last one
# lowest), u and v of its first corner a + u (b - a) + v (c - a), and its edges relative to the whole ones, negative if
# rotated by 180 degrees.
Where = tuple[Any, Any, Any, Any, Any]


def whole() -> Where:
    return mi.UInt32(0), mi.UInt32(0), mi.Float(0), mi.Float(0), mi.Float(1)


def corners_of(a: Any, b: Any, c: Any, where: Where) -> tuple[list[Any], list[Any]]:
    """Unit directions of the corners of a piece of a flat triangle, and of the midpoints of its edges."""
    _, _, u, v, edge = where
    first, along, across = a + (b - a) * u + (c - a) * v, (b - a) * edge, (c - a) * edge
    places = [
        [first, first + along, first + across],
        [first + along / 2, first + (along + across) / 2, first + across / 2],
    ]
    ends, between = (list(map(dr.normalize, few)) for few in places)
    return ends, between


def share_of(where: Where) -> Any:
    """Share of the triangle's area."""
    return where[4] * where[4]


def first_part(where: Where) -> Where:
    cuts, path, u, v, edge = where
    return cuts + 1, path << 2, u, v, edge / 2


def is_last_part(where: Where) -> Any:
    return where[1] & 3 == 3


def next_part(where: Where) -> Where:
    """The next part: at the second and third corner, then the central one, which is rotated."""
    cuts, path, u, v, edge = where
    part = path & 3
    turned = part == 2
    u, v = u + dr.select(part == 1, -edge, edge), v + dr.select(part == 1, edge, 0)
    return cuts, path + 1, u, v, dr.select(turned, -edge, edge)


def parent(where: Where) -> Where:
    """The parent of a last part."""
    cuts, path, u, v, edge = where
    return cuts - 1, path >> 2, u + edge, v + edge, -2 * edge


def angles(corners: list[Any], middles: list[Any], counts: list[int]) -> list[Any]:
    """The angles at a piece's corners, by curve, shifted to give them the mean of the whole piece.

    For quadratic angles, that is the mean at the midpoints of its edges. Angles are convex along most edges:
    uncorrected they would be too large on average, and highlights too dark.
    """
    found = []
    for at, between, end in zip(zip(*corners, strict=True), zip(*middles, strict=True), counts, strict=True):
        shift = (sum(between) - sum(at)) / 3
        found.append(tuple(dr.clip(angle + shift, 0.0, dr.maximum(angle, end)) for angle in at))
    return found


def spread_of(angles: list[Any]) -> tuple[Any, Any]:
    """`overlaps.spread` of a piece by the curve whose angle varies more, and whether that is the second one."""
    if len(angles) == 1:
        return spread(angles[0], (mi.Float(0),) * 3, dr), mi.Bool(False)
    spans = [dr.maximum(dr.maximum(*a[:2]), a[2]) - dr.minimum(dr.minimum(*a[:2]), a[2]) for a in angles]
    turned = spans[1] > spans[0]
    outer, inner = (
        tuple(dr.select(turned, x, y) for x, y in zip(*order, strict=True)) for order in (angles[::-1], angles)
    )
    return spread(outer, inner, dr), turned


def solid_angle(a: Any, b: Any, c: Any, across: Any) -> Any:
    """Solid angle of a triangle at the origin: corners, (b - a) x (c - a) (van Oosterom & Strackee 1983, eq. 8).

    From directions alone, the volume of a small lamp would be lost in rounding.
    """
    volume, x, y, z = dr.abs(dr.dot(a, across)), dr.norm(a), dr.norm(b), dr.norm(c)
    return 2 * dr.atan2(volume, x * y * z + dr.dot(a, b) * z + dr.dot(b, c) * x + dr.dot(c, a) * y)
