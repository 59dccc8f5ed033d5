"""Small objects of the built-in room, on its furniture and walls."""

from __future__ import annotations

import numpy as np

from lambent.scenes.builtin.placing import POLISHED_SCALE, block, thing
from lambent.scenes.geometry import box, cylinder, lathe, merge, placed, sphere, teapot, tube, turn
from lambent.scenes.scene import Mesh, SceneObject


def copper_teapot() -> SceneObject:
    return thing("teapot", "copper", teapot(0.27, 11), light_map_scale=POLISHED_SCALE)


def vase(name: str, material: str, scale: float = 1.0, around: int = 48, rows: int = 3) -> SceneObject:
    """Vase 0.32 m high at scale 1, with a foot, a lip and an inside."""
    outside = [(0.045, 0.006), (0.055, 0.03), (0.085, 0.09), (0.09, 0.15), (0.06, 0.22), (0.032, 0.265), (0.034, 0.3),
               (0.05, 0.32)]  # fmt: skip
    lip = [(0.05, 0.32), (0.049, 0.3225), (0.047, 0.321)]
    inside = [(0.047, 0.321), (0.031, 0.3), (0.029, 0.266), (0.057, 0.219), (0.086, 0.149), (0.08, 0.09), (0.0, 0.02)]
    foot = [(0.0, 0.0), (0.042, 0.0)], [(0.042, 0.0), (0.045, 0.002), (0.045, 0.006)]
    profiles = [np.array(p) * scale for p in (*foot, outside, lip, inside)]
    return thing(name, material, lathe(profiles, around, rows))


def bowl() -> list[SceneObject]:
    """Bowl 0.26 m wide with three oranges."""
    outside = [(0.045, 0.004), (0.09, 0.02), (0.12, 0.05), (0.13, 0.085)]
    lip = [(0.13, 0.085), (0.1285, 0.087), (0.1265, 0.0855)]
    inside = [(0.1265, 0.0855), (0.116, 0.052), (0.087, 0.025), (0.0, 0.014)]
    dish = lathe([[(0, 0), (0.043, 0)], [(0.043, 0), (0.045, 0.004)], outside, lip, inside], 48, 4)
    fruit = [
        placed(sphere(0.039, 24, 12), (0.05 * np.cos(a), 0.06, 0.05 * np.sin(a))) for a in np.radians((80, 200, 320))
    ]
    return [thing("bowl", "ceramic", dish), thing("oranges", "orange_peel", *fruit)]


def books_lying() -> list[SceneObject]:
    """Three books in a pile: covers and pages."""
    covers: dict[str, Mesh] = {}
    pages: list[Mesh] = []
    y = 0.0
    sizes = (("book_blue", 0.2, 0.28, 0.032, 3.0), ("book_ochre", 0.17, 0.24, 0.026, -9.0),
             ("book_red", 0.14, 0.21, 0.02, 12.0))  # fmt: skip
    for material, deep, wide, thick, yaw_deg in sizes:
        board = 0.003
        binding = merge([
            block((-deep / 2, 0, -wide / 2), (deep / 2, board, wide / 2), 0.001),
            block((-deep / 2, thick - board, -wide / 2), (deep / 2, thick, wide / 2), 0.001),
            block((-deep / 2 - 0.0005, 0.0005, -wide / 2), (-deep / 2 + board, thick - 0.0005, wide / 2), 0.001),
        ])  # fmt: skip
        block_of_paper = block(
            (-deep / 2 + 0.002, board - 0.0005, -wide / 2 + 0.004),
            (deep / 2 - 0.004, thick - board + 0.0005, wide / 2 - 0.004),
        )
        covers[material] = placed(binding, (0, y, 0), turn("y", yaw_deg))
        pages.append(placed(block_of_paper, (0, y, 0), turn("y", yaw_deg)))
        y += thick
    return [*(thing(f"pile_{m}", m, mesh) for m, mesh in covers.items()), thing("pile_pages", "paper", *pages)]


def pendant(hang: float) -> list[SceneObject]:
    """Opal globe on a cord: its centre is the origin, the ceiling at `hang` metres above."""
    radius = 0.15
    cap = [(0.0, radius + 0.045), (0.012, radius + 0.045), (0.03, radius + 0.03), (0.034, radius - 0.012)]
    return [
        thing("lamp_globe", "lamp_glass", sphere(radius, 48, 24)),
        thing("lamp_cap", "black_steel", lathe([cap[::-1]], 32, 4)),
        thing("lamp_cord", "black_steel", tube([(0, radius + 0.04, 0), (0, hang, 0)], 0.003, 8)),
        thing("lamp_canopy", "black_steel", placed(cylinder(0.05, 0.032, 32, 0.004), (0, hang - 0.03, 0))),
    ]


def shelf_lamp() -> list[SceneObject]:
    """Small lamp: an opal globe on a turned foot, 0.35 m high."""
    foot = [(0.055, 0.0), (0.055, 0.008), (0.02, 0.02), (0.012, 0.06), (0.012, 0.13), (0.03, 0.155)]
    globe = placed(sphere(0.105, 40, 20), (0, 0.248, 0))
    return [
        thing("shelf_lamp_globe", "lamp_glass", globe),
        thing("shelf_lamp_foot", "dark_oak", lathe([[(0, 0), foot[0]], foot, [foot[-1], (0.0, 0.155)]], 32, 3)),
    ]


def brushed_plate() -> SceneObject:
    """Panel 1.15 x 0.72 m, 15 mm thick, facing +x, brushed along z, its back at x = 0."""
    panel = placed(box((0.015, 0.72, 1.15), 0.0025, (0, 0, 1), 2), (0.0075, 0, 0))
    return thing("brushed_plate", "brushed_aluminium", panel, light_map_scale=POLISHED_SCALE)


def picture() -> list[SceneObject]:
    """Framed abstract, 1.3 x 0.85 m, facing +z, its back at z = 0."""
    wide, high, bar = 0.65, 0.425, 0.022
    frame = [
        block((-wide, -high, -0.002), (-wide + bar, high, 0.03), 0.002, (0, 1, 0)),
        block((wide - bar, -high, -0.002), (wide, high, 0.03), 0.002, (0, 1, 0)),
        block((-wide + bar - 0.003, high - bar, -0.002), (wide - bar + 0.003, high - 0.0005, 0.0295), 0.002),
        block((-wide + bar - 0.003, -high + 0.0005, -0.002), (wide - bar + 0.003, -high + bar, 0.0295), 0.002),
    ]
    sheet = block((-wide + 0.01, -high + 0.01, 0.004), (wide - 0.01, high - 0.01, 0.012))

    def disc(x: float, y: float, radius: float, z: float) -> Mesh:
        return placed(cylinder(radius, 0.002, 64), (x, y, z), turn("x", 90))

    return [
        thing("picture_frame", "dark_oak", *frame),
        thing("picture_sheet", "paper", sheet),
        thing("picture_red", "book_red", disc(-0.18, 0.06, 0.2, 0.0118)),
        thing("picture_blue", "book_blue", block((-0.05, -0.27, 0.011), (0.34, -0.03, 0.0128))),
        thing(
            "picture_ochre",
            "book_ochre",
            disc(0.27, 0.15, 0.11, 0.0116),
            block((-0.42, -0.24, 0.011), (-0.12, -0.2, 0.0126)),
        ),
    ]
