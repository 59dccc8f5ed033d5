"""How much of a triangle lies in a band of an angle, from the angle at its corners alone (Ben-Artzi 2007, 4.2.1).

Functions take `ops`, as `materials.lobes` does.
"""

from __future__ import annotations

from typing import Any

LEAST = 1e-12  # of the difference of two corners: the area below such an edge is all or nothing


def spread(a: Any, b: Any, c: Any, ops: Any) -> tuple[Any, ...]:
    """What `share_below` needs of the corners: smallest, middle and largest, and how the area grows from both ends."""
    low, high = ops.minimum(ops.minimum(a, b), c), ops.maximum(ops.maximum(a, b), c)
    middle = ops.maximum(ops.minimum(a, b), ops.minimum(ops.maximum(a, b), c))
    width = ops.maximum(high - low, LEAST)
    return (
        low,
        middle,
        high,
        1 / (width * ops.maximum(middle - low, LEAST)),
        1 / (width * ops.maximum(high - middle, LEAST)),
    )


def share_below(y: Any, low: Any, middle: Any, high: Any, lower: Any, upper: Any, ops: Any) -> Any:
    """Share of a triangle's area where a linear function of this `spread` at its corners is below y (4.10).

    All of it where all corners are at y.
    """
    rise, fall = y - low, high - y
    inside = ops.select(y < middle, rise * rise * lower, 1 - fall * fall * upper)
    return ops.select(y >= high, 1.0, ops.select(y <= low, 0.0, inside))
