"""A ring on a table, after figure 6.5 of Ben-Artzi 2007: its inside focuses light onto the table, a caustic.

The lights, materials and the camera are in ring.toml.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from lambent.scenes.builtin.things import POLISHED_SCALE, block, thing
from lambent.scenes.geometry import lathe
from lambent.scenes.scene import SceneObject

INNER, OUTER, HIGH, EDGE = 0.0088, 0.0104, 0.0045, 0.0005  # radii, height, radius of the rounded edges, metres
HALF, THICK = 0.06, 0.01  # half the side of the table, its thickness


@cache
def objects() -> tuple[SceneObject, ...]:
    """The ring about the axis of y on a square table, whose top is y = 0."""
    arc = np.linspace(0, np.pi / 2, 7)
    low = [(OUTER - EDGE + EDGE * np.sin(a), EDGE - EDGE * np.cos(a)) for a in arc]
    high = [(r, HIGH - y) for r, y in reversed(low)]
    corners = [low, high, *([(INNER + OUTER - r, y) for r, y in reversed(corner)] for corner in (high, low))]
    sides = [[corner[-1], following[0]] for corner, following in zip(corners, corners[1:] + corners[:1], strict=True)]
    return (
        thing("table", "table", block((-HALF, -THICK, -HALF), (HALF, 0.0, HALF), 0.002, segments=3)),
        thing("ring", "ring", lathe([*corners, *sides], 192, 1), light_map_scale=POLISHED_SCALE),
    )
