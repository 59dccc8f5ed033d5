"""A small scene for quick tests: a box open towards +z, with a lamp in its ceiling and a sphere on its floor."""

from __future__ import annotations

from functools import cache

from lambent.scenes.builtin.things import block, thing
from lambent.scenes.geometry import box as box_mesh
from lambent.scenes.geometry import patch, placed, sphere, turn
from lambent.scenes.scene import SceneObject


@cache
def objects() -> tuple[SceneObject, ...]:
    """The objects of a box from (-0.5, 0, -0.5) to (0.5, 1, 0.5); red left, green right, everything else white."""
    return (
        thing("floor", "white", patch((-0.5, 0, 0.5), (1, 0, 0), (0, 0, -1))),
        thing("ceiling", "white", patch((-0.5, 1, -0.5), (1, 0, 0), (0, 0, 1))),
        thing("back", "white", patch((-0.5, 0, -0.5), (1, 0, 0), (0, 1, 0))),
        thing("left", "red", patch((-0.5, 0, 0.5), (0, 0, -1), (0, 1, 0))),
        thing("right", "green", patch((0.5, 0, -0.5), (0, 0, 1), (0, 1, 0))),
        thing("lamp", "black", block((-0.15, 0.97, -0.15), (0.15, 1.01, 0.15))),
        thing("sphere", "metal", placed(sphere(0.18, 24, 12), (0.2, 0.18, 0.15))),
        thing("block", "white", placed(box_mesh((0.26, 0.5, 0.26)), (-0.2, 0.249, -0.15), turn("y", 20))),
    )
