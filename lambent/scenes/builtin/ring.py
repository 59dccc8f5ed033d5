"""A ring on a table, after figure 6.5 of Ben-Artzi 2007: its inside focuses light onto the table, a caustic.

The lights, materials and the camera are in ring.toml.
"""

from __future__ import annotations

from functools import cache

from lambent.scenes.builtin.placing import POLISHED_SCALE, block, thing
from lambent.scenes.geometry import lathe
from lambent.scenes.scene import SceneObject

INNER, OUTER, HIGH, EDGE = 0.0088, 0.0104, 0.0045, 0.0005  # radii, height, radius of the rounded edges, metres
HALF, THICK = 0.06, 0.01  # half the side of the table, its thickness


@cache
def objects() -> tuple[SceneObject, ...]:
    """The ring about the axis of y on a square table, whose top is y = 0."""
    inside = [(INNER, HIGH - EDGE), (INNER, EDGE)]
    outside = [(OUTER, EDGE), (OUTER, HIGH - EDGE)]
    middle = (INNER + OUTER) / 2
    slope = EDGE * 0.3
    foot = [inside[1], (INNER + slope, slope), (INNER + EDGE, 0.0), (middle, 0.0), (OUTER - EDGE, 0.0),
            (OUTER - slope, slope), outside[0]]  # fmt: skip
    rim = [(r, HIGH - y) for r, y in reversed(foot)]
    return (
        thing("table", "table", block((-HALF, -THICK, -HALF), (HALF, 0.0, HALF), 0.002, segments=3)),
        thing("ring", "ring", lathe([inside, foot, outside, rim], 192, 4), light_map_scale=POLISHED_SCALE),
    )
