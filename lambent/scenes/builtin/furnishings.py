"""The furniture of the built-in room, and the small objects on it and on the walls."""

from __future__ import annotations

import numpy as np

from lambent.scenes.builtin.things import POLISHED_SCALE, block, thing
from lambent.scenes.geometry import box, cushion, cylinder, lathe, merge, patch, placed, sphere, teapot, tube, turn
from lambent.scenes.scene import Mesh, SceneObject

TABLE_HIGH, SIDEBOARD_HIGH, PLINTH_HIGH, SHELF_HIGH = 0.74, 0.72, 0.78, 0.773


def table() -> list[SceneObject]:
    """Dining table, 0.9 x 1.7 m, the grain of its top along z."""
    top = placed(box((0.9, 0.032, 1.7), 0.006, (0, 0, 1), 3), (0, TABLE_HIGH - 0.016, 0))
    base: list[Mesh] = []
    under = TABLE_HIGH - 0.03  # 2 mm inside the top
    for sx in (-1, 1):
        base.append(placed(box((0.024, 0.08, 1.5), 0.002, (0, 0, 1)), (sx * 0.37, under - 0.04, 0)))
        base += [
            placed(
                box((0.055, under, 0.055), 0.006, (0, 1, 0), 2),
                (sx * 0.38, under / 2 - 0.0005, sz * 0.77),
            )
            for sz in (-1, 1)
        ]
    base += [placed(box((0.71, 0.08, 0.024), 0.002), (0, under - 0.041, sz * 0.76)) for sz in (-1, 1)]
    return [thing("table_top", "varnished_wood", top), thing("table_base", "oak", *base)]


def chair(name: str) -> list[SceneObject]:
    """Chair facing +z: bent rods, upholstered seat and back."""
    rods = [tube([(s * 0.2, 0, 0.21), (s * 0.185, 0.44, 0.18)], 0.013, 12) for s in (-1, 1)]
    rods += [
        tube([(s * 0.21, 0, -0.25), (s * 0.19, 0.3, -0.2), (s * 0.185, 0.55, -0.19), (s * 0.185, 0.83, -0.26)], 0.013)
        for s in (-1, 1)
    ]
    rods += [tube([(s * 0.185, 0.425, 0.18), (s * 0.187, 0.425, -0.19)], 0.011, 10) for s in (-1, 1)]
    rods += [tube([(-0.187, 0.425, z), (0.187, 0.425, z)], 0.011, 10) for z in (0.175, -0.185)]
    seat = placed(cushion((0.45, 0.055, 0.44), 5.0, 5), (0, 0.458, 0.005))
    back = placed(cushion((0.42, 0.25, 0.04), 5.0, 5), (0, 0.72, -0.198), turn("x", -14))
    return [thing(f"{name}_frame", "black_steel", *rods), thing(f"{name}_upholstery", "cloth_chair", seat, back)]


def sofa() -> list[SceneObject]:
    """Two-seater, 2.1 m wide, 0.9 m deep, its front towards +z, with piped cushions."""
    body = [
        block((-1.05, 0.12, -0.45), (1.05, 0.3, 0.43), 0.03, segments=3),
        block((-0.84, 0.25, -0.45), (0.84, 0.76, -0.27), 0.06, segments=4),
        block((-1.05, 0.14, -0.452), (-0.84, 0.58, 0.44), 0.07, segments=5),
        block((0.84, 0.14, -0.452), (1.05, 0.58, 0.44), 0.07, segments=5),
    ]
    piping = []
    for s in (-1, 1):
        body.append(placed(cushion((0.845, 0.19, 0.74), 6.0, 7), (s * 0.42, 0.378, 0.09)))
        tilt = turn("x", -13)
        body.append(placed(cushion((0.83, 0.46, 0.19), 5.0, 7), (s * 0.42, 0.665, -0.2), tilt))
        piping.append(placed(_piping(0.845, 0.74, 6.0), (s * 0.42, 0.378, 0.09)))
        piping.append(placed(_piping(0.83, 0.46, 5.0), (s * 0.42, 0.665, -0.2), tilt @ turn("x", 90)))
    feet = [placed(cylinder(0.022, 0.13, 20, 0.003), (x, 0, z)) for x in (-0.96, 0.96) for z in (-0.37, 0.35)]
    pillows = [
        placed(cushion((0.46, 0.46, 0.17), 3.4, 7), (-0.62, 0.665, -0.02), turn("y", 14) @ turn("x", -20)),
        placed(cushion((0.42, 0.42, 0.16), 3.4, 7), (0.64, 0.65, -0.02), turn("y", -22) @ turn("x", -22)),
    ]
    return [
        thing("sofa", "cloth_sofa", *body),
        thing("sofa_piping", "cloth_piping", *piping),
        thing("sofa_feet", "dark_oak", *feet),
        thing("pillow_left", "cloth_rust", pillows[0]),
        thing("pillow_right", "cloth_chair", pillows[1]),
    ]


def _piping(wide: float, deep: float, exponent: float) -> Mesh:
    """Cord along the seam of a cushion: its superellipse in the plane y = 0."""
    phi = np.linspace(0, 2 * np.pi, 41)[:-1]
    u, v = np.cos(phi), np.sin(phi)
    # The parameter of a superellipse that spreads points evenly enough round its corners.
    scale = 1 / (np.abs(u) ** exponent + np.abs(v) ** exponent) ** (1 / exponent)
    points = np.stack([u * scale * wide / 2, np.zeros_like(u), v * scale * deep / 2], axis=-1)
    return tube(points, 0.006, 6, 2, closed=True)


def sideboard() -> list[SceneObject]:
    """Sideboard 1.8 m long along z, 0.42 m deep, its back at x = 0 and its doors towards +x."""
    high = SIDEBOARD_HIGH - 0.024
    carcass = [block((0.002, 0.16, -0.88), (0.4, high + 0.002, 0.88), 0.003)]
    doors = [
        block((0.39, 0.175, z - 0.287), (0.418, high - 0.012, z + 0.287), 0.003, (0, 1, 0), 2) for z in (-0.58, 0, 0.58)
    ]
    legs = [placed(cylinder(0.017, 0.165, 16, 0.002), (x, 0, z)) for x in (0.06, 0.34) for z in (-0.78, 0.78)]
    knobs = [
        placed(lathe([[(0.0, 0.0), (0.006, 0.001), (0.006, 0.012), (0.013, 0.02), (0.0, 0.024)]], 16, 3),
               (0.417, 0.45, z), turn("z", -90))
        for z in (-0.34, 0.24, 0.34)
    ]  # fmt: skip
    top = block((0.0, high, -0.9), (0.43, SIDEBOARD_HIGH, 0.9), 0.004, (0, 0, 1), 2)
    return [
        thing("sideboard_top", "varnished_wood", top),
        thing("sideboard_body", "oak", *carcass),
        thing("sideboard_doors", "green_lacquer", *doors),
        thing("sideboard_legs", "black_steel", *legs),
        thing("sideboard_knobs", "dark_oak", *knobs),
    ]


def plinth() -> list[SceneObject]:
    """Plinth with a ring, and a metal sphere at rest in it."""
    radius, ring, cord = 0.17, 0.075, 0.012
    base = placed(box((0.34, PLINTH_HIGH, 0.34), 0.006, (0, 1, 0), 2), (0, PLINTH_HIGH / 2, 0))
    turns = np.linspace(0, 2 * np.pi, 13)[:-1]
    circle = np.stack([ring * np.cos(turns), np.zeros(12), ring * np.sin(turns)], axis=-1)
    seat = placed(tube(circle, cord, 16, 4, closed=True), (0, PLINTH_HIGH + cord - 0.001, 0))
    # The sphere touches the ring where their circles of radius `radius` and `cord` do.
    lift = PLINTH_HIGH + cord - 0.001 + np.sqrt((radius + cord) ** 2 - ring**2)
    ball = placed(sphere(radius, 72, 36), (0, float(lift), 0))
    return [
        thing("plinth", "plaster", base),
        thing("plinth_ring", "dark_oak", seat),
        thing("steel_sphere", "steel", ball, light_map_scale=POLISHED_SCALE),
    ]


def screen() -> list[SceneObject]:
    """Free-standing frosted pane in a frame, 1.2 x 1.85 m, in the plane z = 0."""
    wide, high, bar, foot = 0.6, 1.85, 0.045, 0.1
    frame = [
        block((-wide, 0.02, -0.02), (-wide + bar, high, 0.02), 0.004, (0, 1, 0), 2),
        block((wide - bar, 0.02, -0.02), (wide, high, 0.02), 0.004, (0, 1, 0), 2),
        block((-wide + bar - 0.006, foot, -0.019), (wide - bar + 0.006, foot + bar, 0.019), 0.003),
        block((-wide + bar - 0.006, high - bar - 0.001, -0.019), (wide - bar + 0.006, high - 0.001, 0.019), 0.003),
    ]
    frame += [block((s * (wide - bar / 2) - 0.03, 0, -0.2), (s * (wide - bar / 2) + 0.03, 0.028, 0.2), 0.005)
              for s in (-1, 1)]  # fmt: skip
    edge = wide - bar + 0.004
    pane = patch((-edge, foot + bar - 0.004, 0), (2 * edge, 0, 0), (0, high - foot - 2 * bar + 0.007, 0), (8, 12))
    return [thing("screen_frame", "dark_oak", *frame), thing("screen_pane", "frosted_glass", pane)]


def shelf() -> list[SceneObject]:
    """Low open shelf 1.1 m long along x, its back at z = 0, open towards -z, with a row of books and a tall jar."""
    boards = [
        block((-0.55, 0.0, -0.3), (-0.525, 0.75, -0.001), 0.002),
        block((0.525, 0.0, -0.3), (0.55, 0.75, -0.001), 0.002),
        block((-0.527, 0.05, -0.298), (0.527, 0.075, -0.002), 0.002),
        block((-0.527, 0.38, -0.298), (0.527, 0.405, -0.002), 0.002),
        block((-0.551, 0.748, -0.302), (0.551, SHELF_HIGH, 0.0), 0.002),
        block((-0.527, 0.06, -0.012), (0.527, 0.75, -0.003), 0.0),
    ]
    rng = np.random.default_rng(4)
    spines: dict[str, list[Mesh]] = {"book_red": [], "book_blue": [], "book_ochre": [], "paper": []}
    for level in (0.075, 0.405):
        x = -0.515
        while x < 0.47:
            thick, tall, deep = rng.uniform(0.018, 0.045), rng.uniform(0.2, 0.28), rng.uniform(0.15, 0.21)
            colour = ("book_red", "book_blue", "book_ochre", "paper")[rng.integers(4)]
            spines[colour].append(block((x, level - 0.0005, -0.03 - deep), (x + thick, level + tall, -0.03)))
            x += thick + 0.0015
    return [
        thing("shelf", "oak", *boards),
        *(thing(f"shelf_{colour}", colour, *books) for colour, books in spines.items()),
    ]


def rug() -> SceneObject:
    """Rug 2.5 x 1.7 m with a rounded edge."""
    return thing("rug", "rug", placed(box((2.5, 0.014, 1.7), 0.006, segments=2), (0, 0.007, 0)))


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
