"""The Cornell box, as measured at Cornell University in 1985: 555 x 549 x 559 mm, a lamp in its ceiling, two boxes.

Walls are set at right angles. The ceiling and the back wall share a material, and so does the lamp's panel. The
materials and the camera are in cornell.toml.
"""

from __future__ import annotations

from functools import cache

from lambent.scenes.builtin.things import thing
from lambent.scenes.geometry import box, patch, placed, turn
from lambent.scenes.scene import Mesh, SceneObject

X, Z, HEIGHT = 0.2775, 0.2796, 0.5488  # half width, half depth, height, metres
LAMP_X, LAMP_Z = 0.065, 0.0525  # half sides of the lamp, which is flush with the ceiling
SINK = 0.001  # of the boxes into the floor


@cache
def objects() -> tuple[SceneObject, ...]:
    """The box about the axis of y, its floor in y = 0, open towards +z."""
    return (
        thing("floor", "floor", patch((-X, 0, Z), (2 * X, 0, 0), (0, 0, -2 * Z))),
        thing("ceiling", "back_wall", *_ceiling()),
        thing("back_wall", "back_wall", patch((-X, 0, -Z), (2 * X, 0, 0), (0, HEIGHT, 0))),
        thing("left_wall", "left_wall", patch((-X, 0, Z), (0, 0, -2 * Z), (0, HEIGHT, 0))),
        thing("right_wall", "right_wall", patch((X, 0, -Z), (0, 0, 2 * Z), (0, HEIGHT, 0))),
        thing("lamp", "back_wall", _down((-LAMP_X, LAMP_X), (-LAMP_Z, LAMP_Z))),
        thing("small_box", "small_box", _standing(0.165, (0.0925, 0.1106), -16.6)),
        thing("large_box", "large_box", _standing(0.33, (-0.0905, -0.0717), 17.2)),
    )


def _down(x: tuple[float, float], z: tuple[float, float]) -> Mesh:
    """A part of the ceiling."""
    return patch((x[0], HEIGHT, z[0]), (x[1] - x[0], 0, 0), (0, 0, z[1] - z[0]))


def _ceiling() -> list[Mesh]:
    """Four parts about the lamp."""
    sides = [_down((-X, -LAMP_X), (-Z, Z)), _down((LAMP_X, X), (-Z, Z))]
    return [*sides, _down((-LAMP_X, LAMP_X), (-Z, -LAMP_Z)), _down((-LAMP_X, LAMP_X), (LAMP_Z, Z))]


def _standing(height: float, at: tuple[float, float], yaw_deg: float) -> Mesh:
    """A box of 165 x 165 mm whose top is at `height`."""
    mesh = box((0.165, height + SINK, 0.165))
    return placed(mesh, (at[0], (height - SINK) / 2, at[1]), turn("y", yaw_deg))
