"""Mesh building blocks: shapes with analytic normals, uv and a brushing direction."""

from lambent.scenes.geometry.grid import (
    build,
    copies_under,
    grid,
    merge,
    placed,
    signed_volume,
    subdivided,
    tangents_along,
    transformed,
    turn,
)
from lambent.scenes.geometry.shapes import (
    box,
    catmull_rom,
    cushion,
    cylinder,
    extrusion,
    fan,
    lathe,
    patch,
    smooth_curve,
    sphere,
    tube,
)
from lambent.scenes.geometry.teapot import teapot, teapot_parts

__all__ = [
    "box", "build", "catmull_rom", "copies_under", "cushion", "cylinder", "extrusion", "fan", "grid", "lathe", "merge",
    "patch", "placed", "signed_volume", "smooth_curve", "sphere", "subdivided",
    "tangents_along", "teapot",
    "teapot_parts",
    "transformed", "tube", "turn",
]  # fmt: skip
