"""Overlap of a triangle with the nodes of a curve, from the angles at its corners alone (Ben-Artzi 2007, 4.2.1).

Curves are linear between nodes. If an angle a is linear over a triangle, nodes cut the triangle into parts. The area of
each part (4.10) and its mean of a determine exactly the shares of the hat functions of its two nodes; its mean of a
second angle b gives its position along b. Functions take `ops`, as `materials.lobes` does.
"""

from __future__ import annotations

from typing import Any

LEAST = 1e-12  # difference of two corners below which an edge counts as having all or none of the area below it

Three = tuple[Any, Any, Any]
Spread = tuple[Three, Three, Three]


def spread(a: Three, b: Three, ops: Any) -> Spread:
    """a at the corners in ascending order, b at the same corners, and 1 over the differences of a: 01, 02, 12."""
    corners = list(zip(a, b, strict=True))
    for i, k in ((0, 1), (1, 2), (0, 1)):
        (a0, b0), (a1, b1) = corners[i], corners[k]
        turned = a1 < a0
        corners[i] = ops.minimum(a0, a1), ops.select(turned, b1, b0)
        corners[k] = ops.maximum(a0, a1), ops.select(turned, b0, b1)
    (low, middle, high), at = zip(*corners, strict=True)
    apart = [1 / ops.maximum(difference, LEAST) for difference in (middle - low, high - low, high - middle)]
    return (low, middle, high), at, (apart[0], apart[1], apart[2])


def below(y: Any, of: Spread, ops: Any) -> Three:
    """The part of a triangle where a is below y: its share of the area (4.10), and the integrals of a and b over it.

    The whole triangle if all corners are at y. a and b are relative to their values at the lowest corner, to avoid
    cancellation.
    """
    (low, middle, high), (b0, b1, b2), (to_1, to_2, from_1) = of
    rise, fall, width = y - low, high - y, high - low
    side_1, side_2 = b1 - b0, b2 - b0
    up_1, up_2, down_1, down_0 = rise * to_1, rise * to_2, fall * from_1, fall * to_2
    under, over = up_1 * up_2, down_1 * down_0
    a_all, b_all = (middle - low + width) / 3, (side_1 + side_2) / 3
    first = y < middle
    share = ops.select(first, under, 1 - over)
    of_a = ops.select(first, under * (rise * (2 / 3)), a_all - over * (width - fall * (2 / 3)))
    of_b = ops.select(
        first,
        under * (up_1 * side_1 + up_2 * side_2) / 3,
        b_all - over * (side_2 + (down_1 * (side_1 - side_2) - down_0 * side_2) / 3),
    )
    all_of_it, none = y >= high, y <= low
    return tuple(
        ops.select(all_of_it, whole, ops.select(none, 0.0, part))
        for whole, part in ((1.0, share), (a_all, of_a), (b_all, of_b))
    )
