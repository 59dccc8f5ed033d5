"""How much of a triangle lies in a band of an angle, from the angle at its corners alone (Ben-Artzi 2007, 4.2.1).

Functions take `ops`, as `materials.lobes` does.
"""

from __future__ import annotations

from typing import Any

LEAST = 1e-12  # of the difference of two corners: the area below such an edge is all or nothing


def in_order(a: Any, b: Any, c: Any, ops: Any) -> tuple[Any, Any, Any]:
    """The smallest, the middle and the largest."""
    low, high = ops.minimum(ops.minimum(a, b), c), ops.maximum(ops.maximum(a, b), c)
    middle = ops.maximum(ops.minimum(a, b), ops.minimum(ops.maximum(a, b), c))
    return low, middle, high


def share_below(y: Any, low: Any, middle: Any, high: Any, ops: Any) -> Any:
    """Share of a triangle's area where a linear function with these values at its corners, in order, is below y (4.10).

    All of it where all corners are at y.
    """
    rise, fall = y - low, high - y
    width = ops.maximum(high - low, LEAST)
    lower = rise * rise / (width * ops.maximum(middle - low, LEAST))
    upper = 1 - fall * fall / (width * ops.maximum(high - middle, LEAST))
    inside = ops.select(y < middle, lower, upper)
    return ops.select(y >= high, 1.0, ops.select(y <= low, 0.0, inside))
