"""How much of a triangle lies in a band of an angle, from the angle at its corners alone (Ben-Artzi 2007, 4.2.1).

Functions take `ops`, as `materials.lobes` does.
"""

from __future__ import annotations

from typing import Any

LEAST = 1e-12  # of the difference of two corners: the area below such an edge is all or nothing


Spread = tuple[Any, Any, Any, Any, Any]


def spread(a: Any, b: Any, c: Any, ops: Any) -> Spread:
    """The values at the corners in order, and shares of the area by square of the distance from first and last."""
    low, high = ops.minimum(ops.minimum(a, b), c), ops.maximum(ops.maximum(a, b), c)
    middle = ops.maximum(ops.minimum(a, b), ops.minimum(ops.maximum(a, b), c))
    width = ops.maximum(high - low, LEAST)
    below, above = (width * ops.maximum(difference, LEAST) for difference in (middle - low, high - middle))
    return low, middle, high, 1 / below, 1 / above


def share_below(y: Any, of: Spread, ops: Any) -> Any:
    """Share of a triangle's area where a linear function with this spread is below y (4.10).

    All of it where all corners are at y.
    """
    low, middle, high, from_low, from_high = of
    rise, fall = y - low, high - y
    inside = ops.select(y < middle, rise * rise * from_low, 1 - fall * fall * from_high)
    return ops.select(y >= high, 1.0, ops.select(y <= low, 0.0, inside))
