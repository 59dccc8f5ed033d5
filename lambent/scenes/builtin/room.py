"""The geometry of the built-in room. Its lights, materials and cameras are in room.toml."""

from __future__ import annotations

from functools import cache

from lambent.scenes.builtin import furniture, props
from lambent.scenes.builtin.garden import garden
from lambent.scenes.builtin.placing import at
from lambent.scenes.builtin.shell import HEIGHT, X, Z, shell
from lambent.scenes.geometry import turn
from lambent.scenes.scene import SceneObject

TABLE = (1.2, 0.0, 1.05)
SIDEBOARD = (-X, 0.0, -0.55)


@cache
def objects() -> tuple[SceneObject, ...]:
    """Every object of the room, in world space."""
    table_x, _, table_z = TABLE
    on_table, on_sideboard = furniture.TABLE_HIGH, furniture.SIDEBOARD_HIGH
    things = [*shell(), *garden(), *at(furniture.table(), TABLE)]
    for name, x, z, yaw_deg in (
        ("chair_1", table_x - 0.62, table_z - 0.38, 86.0),
        ("chair_2", table_x - 0.56, table_z + 0.42, 94.0),
        ("chair_3", table_x + 0.6, table_z + 0.36, -90.0),
        ("chair_4", table_x + 0.02, table_z - 1.06, 4.0),
    ):
        things += at(furniture.chair(name), (x, 0.0, z), turn("y", yaw_deg))
    things += at([props.copper_teapot()], (table_x - 0.08, on_table, table_z - 0.28), turn("y", -35))
    things += at([props.vase("vase", "ceramic")], (table_x + 0.12, on_table, table_z + 0.12))
    things += at(props.bowl(), (table_x - 0.1, on_table, table_z + 0.5))
    things += at(props.pendant(HEIGHT - 1.75), (table_x, 1.75, table_z))
    things += at(furniture.sofa(), (-0.35, 0.0, -Z + 0.47))
    things += at([furniture.rug()], (-0.35, 0.0, -1.45))
    things += at(props.picture(), (-0.35, 1.55, -Z))
    things += at(furniture.plinth(), (1.75, 0.0, -2.45), turn("y", 20))
    things += at(furniture.sideboard(), SIDEBOARD)
    things += at([props.brushed_plate()], (-X, 1.42, SIDEBOARD[2]))
    things += at(
        [props.vase("vase_small", "ceramic_blue", 0.7, 40, 2)], (-X + 0.2, on_sideboard - 0.0005, SIDEBOARD[2] - 0.62)
    )
    things += at(props.books_lying(), (-X + 0.22, on_sideboard, SIDEBOARD[2] + 0.55))
    things += at(furniture.screen(), (-1.35, 0.0, 2.38))
    things += at(furniture.shelf(), (-1.35, 0.0, Z - 0.016))
    on_shelf = furniture.SHELF_HIGH - 0.0005
    things += at([props.vase("vase_red", "ceramic_red", 1.15, 40, 2)], (-1.13, on_shelf, Z - 0.17))
    things += at(props.shelf_lamp(), (-1.62, on_shelf, Z - 0.17))
    return tuple(things)
