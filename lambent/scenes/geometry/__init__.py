"""Mesh building blocks: shapes with analytic normals, uv and a brushing direction."""

from lambent.scenes.geometry.curves import catmull_rom, smooth_curve
from lambent.scenes.geometry.grid import (
    build,
    copies_under,
    grid,
    merge,
    placed,
    signed_volume,
    tangents_along,
    transformed,
    turn,
)
from lambent.scenes.geometry.shapes import box, cushion, cylinder, extrusion, fan, lathe, patch, sphere, tube
from lambent.scenes.geometry.subdivision import subdivided
from lambent.scenes.geometry.teapot import teapot, teapot_parts

__all__ = [
    "box", "build", "catmull_rom", "copies_under", "cushion", "cylinder", "extrusion", "fan", "grid", "lathe", "merge",
    "patch", "placed", "signed_volume", "smooth_curve", "sphere", "subdivided",
    "tangents_along", "teapot",
    "teapot_parts",
    "transformed", "tube", "turn",
]  # fmt: skip
