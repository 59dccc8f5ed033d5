"""The built-in room and the view from its window. Its lights, materials and cameras are in room.toml.

The room is 5.2 x 6.4 m, 2.8 m high, with one wide window to the east (+x) and a door to the south (+z). Its inner
surfaces and the shell outside share the window's outer rim. Together they are walls of some thickness, closed except
for the window, so that no light leaks in. The window shows a terrace that reflects daylight up to the ceiling, a lawn,
a hedge and three trees.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from lambent.scenes.builtin import furnishings
from lambent.scenes.builtin.things import at, block, thing
from lambent.scenes.geometry import build, cushion, cylinder, extrusion, grid, merge, patch, placed, tube, turn
from lambent.scenes.scene import Mesh, SceneObject

X, Z, HEIGHT = 2.6, 3.2, 2.8  # half width, half depth, height
THICK = 0.25
JOINT, JOINT_DEPTH, TILE, BEVEL = 0.006, 0.004, 0.6, 0.002
WINDOW_Z, WINDOW_Y = (-1.3, 1.9), (0.5, 2.45)
DOOR_X = (0.75, 1.65)
SKIRTING_HIGH, SKIRTING_THICK = 0.09, 0.014
TABLE, SIDEBOARD = (1.2, 0.0, 1.05), (-X, 0.0, -0.55)
GROUND = -0.15
TERRACE, LAWN, HEDGE_HIGH = 5.0, 15.0, 2.3  # radii and height, metres
COARSE = 0.05  # light map density of distant surfaces


def shell() -> list[SceneObject]:
    """Walls, ceiling, floor, window, door and skirting."""
    return [*_surfaces(), *_floor(), *_window(), *_door(), _skirting()]


def _with_hole(us: tuple[float, ...], vs: tuple[float, ...], x: float, facing: float) -> Mesh:
    """Wall in the plane x with grid lines at z = us and y = vs (four each), its middle field open, facing +x or -x."""
    z, y = np.meshgrid(us, vs, indexing="ij")
    points = np.stack([np.full(16, x), y.ravel(), z.ravel()], axis=-1)
    index = np.arange(16).reshape(4, 4)
    faces = [
        triangle
        for i in range(3)
        for j in range(3)
        if (i, j) != (1, 1)
        for a, b, c, d in [(index[i, j], index[i + 1, j], index[i + 1, j + 1], index[i, j + 1])]
        for triangle in ((a, b, c), (a, c, d))
    ]
    normals = np.tile([facing, 0.0, 0.0], (16, 1))
    return build(points, normals, (0, 0, 1), points[:, [2, 1]], np.array(faces))


def _surfaces() -> list[SceneObject]:
    y0 = -JOINT_DEPTH
    (z_low, z_high), (y_low, y_high) = WINDOW_Z, WINDOW_Y
    deep, wide, high = (THICK, 0, 0), (0, 0, z_high - z_low), (0, y_high - y_low, 0)
    walls = thing(
        "walls",
        "wall_paint",
        _with_hole((-Z, z_low, z_high, Z), (y0, y_low, y_high, HEIGHT), X, -1.0),
        patch((-X, y0, Z), (0, 0, -2 * Z), (0, HEIGHT - y0, 0)),
        patch((-X, y0, -Z), (2 * X, 0, 0), (0, HEIGHT - y0, 0)),
        patch((X, y0, Z), (-2 * X, 0, 0), (0, HEIGHT - y0, 0)),
    )
    reveal = thing(
        "window_reveal",
        "ceiling_paint",
        patch((X, y_low, z_low), wide, deep),
        patch((X, y_high, z_low), deep, wide),
        patch((X, y_low, z_low), deep, high),
        patch((X, y_low, z_high), high, deep),
    )
    ceiling = thing("ceiling", "ceiling_paint", patch((-X, HEIGHT, -Z), (2 * X, 0, 0), (0, 0, 2 * Z)))
    x, z, low, top = X + THICK, Z + THICK, -THICK, HEIGHT + THICK
    outside = thing(
        "shell",
        "wall_paint",
        _with_hole((-z, z_low, z_high, z), (low, y_low, y_high, top), x, 1.0),
        patch((-x, low, -z), (0, 0, 2 * z), (0, top - low, 0)),
        patch((x, low, -z), (-2 * x, 0, 0), (0, top - low, 0)),
        patch((-x, low, z), (2 * x, 0, 0), (0, top - low, 0)),
        patch((-x, top, -z), (0, 0, 2 * z), (2 * x, 0, 0)),
        patch((-x, low, -z), (2 * x, 0, 0), (0, 0, 2 * z)),
        light_map_scale=0.1,
    )
    return [walls, reveal, ceiling, outside]


def _lines(half: float) -> list[tuple[float, float]]:
    """From and to of each tile along one axis: a tile in the middle, the last ones cut at the walls."""
    count = int(np.ceil((half - TILE / 2) / TILE))
    edges = [max(-half, min(half, (i - 0.5) * TILE)) for i in range(-count, count + 2)]
    inset = [0.0 if abs(e) == half else JOINT / 2 for e in edges]
    return [(a + i, b - j) for (a, i), (b, j) in zip(
        zip(edges[:-1], inset[:-1], strict=True), zip(edges[1:], inset[1:], strict=True), strict=True)]  # fmt: skip


def _tile(x: tuple[float, float], z: tuple[float, float]) -> Mesh:
    """Top of a tile, its chamfered edge and its side down to the joint."""

    def ring(a: tuple[float, float], inset: float, y: float) -> list[tuple[float, float, float]]:
        (x0, x1), (z0, z1) = (x[0] + inset, x[1] - inset), (z[0] + inset, z[1] - inset)
        return [(x0, y, z0), (x0, y, z1), (x1, y, z1), (x1, y, z0), (x0, y, z0)]

    top = ring(x, BEVEL, 0.0)
    rings = np.array([ring(x, 0.0, -JOINT_DEPTH), ring(x, 0.0, -BEVEL), top])
    sides = []
    for k, out in enumerate([(-1, 0, 0), (0, 0, 1), (1, 0, 0), (0, 0, -1)]):
        tilted = np.array(out) + np.array([0, 0.2, 0])
        for low, high, n_low, n_high in ((0, 1, out, out), (1, 2, tilted, (0, 1, 0))):
            corners = rings[[low, high]][:, [k, k + 1]]
            normals = np.stack([np.tile(n_low, (2, 1)), np.tile(n_high, (2, 1))]).astype(float)
            sides.append(grid(corners, normals, (1, 0, 0), corners[..., [0, 2]]))
    (x0, y0, z0), (x1, _, z1) = top[0], top[2]
    return merge([patch((x0, y0, z0), (0, 0, z1 - z0), (x1 - x0, 0, 0)), *sides])


def _floor() -> list[SceneObject]:
    columns, rows = _lines(X), _lines(Z)
    tiles: tuple[list[Mesh], list[Mesh]] = ([], [])
    joints = []
    for i, x in enumerate(columns):
        for j, z in enumerate(rows):
            tiles[(i + j) % 2].append(_tile(x, z))
            # Strips lie at slightly different heights, so that the atlas makes each a small chart, not all together one
            # chart of the size of the floor.
            y = -JOINT_DEPTH - 0.0001 * ((i + j) % 2)
            if j + 1 < len(rows):
                joints.append(patch((x[0], y, z[1]), (0, 0, JOINT), (x[1] - x[0], 0, 0)))
            if i + 1 < len(columns):
                end = z[1] + (JOINT if j + 1 < len(rows) else 0)
                joints.append(patch((x[1], y - 0.0002, z[0]), (0, 0, end - z[0]), (JOINT, 0, 0)))
    return [
        thing("floor_tiles_light", "tile_light", *tiles[0]),
        thing("floor_tiles_dark", "tile_dark", *tiles[1]),
        thing("grout", "grout", *joints, light_map_scale=4.0),
    ]


def _window() -> list[SceneObject]:
    (z0, z1), (y0, y1) = WINDOW_Z, WINDOW_Y
    x0, x1, bar, sink = X + 0.13, X + 0.19, 0.055, 0.01
    bars = [
        block((x0, y0 - sink, z0 - sink), (x1, y0 + bar, z1 + sink), 0.004),
        block((x0, y1 - bar, z0 - sink), (x1, y1 + sink, z1 + sink), 0.004),
    ]
    thirds = np.linspace(z0, z1, 4)
    for z in (z0 + bar / 2 - sink / 2, thirds[1], thirds[2], z1 - bar / 2 + sink / 2):
        # Uprights stand a millimetre back from the rails: no two faces share a plane.
        bars.append(block((x0 + 0.001, y0, z - bar / 2), (x1 - 0.001, y1, z + bar / 2), 0.004))
    sill = block((X - 0.06, y0 - 0.02, z0 - 0.06), (x0 + 0.005, y0 + 0.012, z1 + 0.06), 0.006, (0, 0, 1), 2)
    rod = tube([(X - 0.09, y1 + 0.13, z0 - 0.55), (X - 0.09, y1 + 0.13, z1 + 0.55)], 0.012, 16)
    curtains = [_curtain(z0 - 0.48, z0 + 0.02), _curtain(z1 - 0.02, z1 + 0.48)]
    return [
        thing("window_frame", "white_lacquer", *bars),
        thing("window_sill", "white_lacquer", sill),
        thing("curtain_rod", "dark_oak", rod),
        thing("curtains", "curtain", *curtains),
    ]


def _curtain(z0: float, z1: float) -> Mesh:
    """Sheet in folds, from the rod to just above the floor."""
    z = np.linspace(z0, z1, 73)
    phase = 2 * np.pi * (z - z0) / 0.083
    y = np.array([0.02, 0.5, 1.0, 1.5, 2.0, WINDOW_Y[1] + 0.118])
    depth = 0.026 * (1 + 0.25 * np.sin(1.7 * phase / np.pi))[None, :] * np.linspace(1, 0.55, len(y))[:, None]
    x = X - 0.09 + depth * np.sin(phase)
    slope = depth * np.cos(phase) * 2 * np.pi / 0.083
    positions = np.stack(np.broadcast_arrays(x, y[:, None], z[None, :]), axis=-1)
    normals = np.stack(np.broadcast_arrays(-1.0, 0.0, slope), axis=-1)
    return grid(positions, normals, (0, 1, 0), positions[..., [2, 1]])


def _door() -> list[SceneObject]:
    (x0, x1), top, sink = DOOR_X, 2.05, 0.005
    case = 0.08
    frame = [
        block((x0 - case, 0, Z - 0.035), (x0, top, Z + sink), 0.004),
        block((x1, 0, Z - 0.035), (x1 + case, top, Z + sink), 0.004),
        block((x0 - case, top, Z - 0.036), (x1 + case, top + case, Z + sink), 0.004),
    ]
    leaf = [block((x0 - 0.002, 0.006, Z - 0.02), (x1 + 0.002, top + 0.002, Z + sink))]
    panels = [
        block((x0 + 0.13, low, Z - 0.028), (x1 - 0.13, high, Z), 0.006, segments=2)
        for low, high in ((0.22, 0.92), (1.08, 1.9))
    ]
    handle = tube(
        [(x0 + 0.07, 1.03, Z - 0.01), (x0 + 0.07, 1.03, Z - 0.065), (x0 + 0.1, 1.03, Z - 0.07),
         (x0 + 0.19, 1.03, Z - 0.07)], 0.009, 12,
    )  # fmt: skip
    return [
        thing("door_frame", "white_lacquer", *frame),
        thing("door", "white_lacquer", *leaf, *panels),
        thing("door_handle", "dark_oak", handle),
    ]


def _skirting() -> SceneObject:
    t, h, sink = SKIRTING_THICK, SKIRTING_HIGH, 0.002
    profile = [(-sink, 0.0), (t, 0.0), (t, h - 0.012), (t - 0.006, h - 0.002), (t - 0.01, h), (-sink, h)]
    case = 0.08

    def along(start: tuple[float, float], length: float, yaw_deg: float) -> Mesh:
        return placed(extrusion(profile, length), (start[0], 0.0, start[1]), turn("y", yaw_deg))

    return thing(
        "skirting",
        "white_lacquer",
        along((-X, -Z), 2 * Z, 0),
        along((X, Z), 2 * Z, 180),
        along((X - t, -Z), 2 * (X - t), -90),
        along((-X + t, Z), DOOR_X[0] - case + X - t, 90),
        along((DOOR_X[1] + case, Z), X - t - DOOR_X[1] - case, 90),
    )


def garden() -> list[SceneObject]:
    """A half disc of ground before the east wall, closed by a hedge that hides the horizon."""
    trees = ((8.2, -4.6, 2.7, 1.35), (12.0, 3.4, 3.4, 1.8), (10.5, 8.5, 3.0, 1.5))
    crowns = [placed(cushion((2 * r, 2.2 * r, 2 * r), 2.2, 4), (x, GROUND + y + 0.6, z)) for x, z, y, r in trees]
    trunks = [placed(cylinder(0.11, y, 12), (x, GROUND - 0.05, z)) for x, z, y, _ in trees]
    return [
        thing("terrace", "gravel", _ring(0.0, TERRACE), light_map_scale=COARSE),
        thing("lawn", "grass", _ring(TERRACE, LAWN), light_map_scale=COARSE),
        thing("hedge", "leaves", _hedge(), light_map_scale=COARSE),
        thing("tree_crowns", "leaves", *crowns, light_map_scale=COARSE),
        thing("tree_trunks", "dark_oak", *trunks, light_map_scale=COARSE),
    ]


def _half_circle(steps: int) -> np.ndarray:
    """Directions (steps + 1, 3) from north over east to south."""
    phi = np.linspace(-np.pi / 2, np.pi / 2, steps + 1)
    return np.stack([np.cos(phi), np.zeros_like(phi), np.sin(phi)], axis=-1)


def _ring(inner: float, outer: float) -> Mesh:
    radii = np.linspace(inner, outer, 5)
    origin = np.array([X + THICK - 0.05, GROUND, 0.0])
    positions = origin + radii[:, None, None] * _half_circle(32)
    return grid(positions, np.broadcast_to([0.0, 1.0, 0.0], positions.shape), (1, 0, 0), positions[..., [0, 2]])


def _hedge() -> Mesh:
    """Inner side and rounded top of a hedge with a slightly uneven crown."""
    around = _half_circle(96)
    phi = np.linspace(-np.pi / 2, np.pi / 2, 97)
    crown = HEDGE_HIGH + 0.08 * np.sin(9 * phi) + 0.05 * np.sin(23 * phi + 1)
    arc = np.linspace(0, np.pi / 2, 5)
    inward = np.concatenate([[0.0, 0.0], 0.4 * (1 - np.cos(arc[1:]))])
    share = np.concatenate([[-0.02, 0.82], 0.82 + 0.18 * np.sin(arc[1:])])
    tilt = np.concatenate([[0.0, 0.0], arc[1:]])
    origin = np.array([X + THICK - 0.05, GROUND, 0.0])
    up = np.array([0.0, 1.0, 0.0])
    positions = origin + (LAWN - 0.3 + inward)[:, None, None] * around + (share[:, None] * crown)[..., None] * up
    normals = -np.cos(tilt)[:, None, None] * around + np.sin(tilt)[:, None, None] * up
    uv = np.stack(np.broadcast_arrays(LAWN * phi[None, :], share[:, None] * HEDGE_HIGH), axis=-1)
    return grid(positions, normals, up, uv)


@cache
def objects() -> tuple[SceneObject, ...]:
    """Every object of the room, in world space."""
    table_x, _, table_z = TABLE
    on_table, on_sideboard = furnishings.TABLE_HIGH, furnishings.SIDEBOARD_HIGH
    things = [*shell(), *garden(), *at(furnishings.table(), TABLE)]
    for name, x, z, yaw_deg in (
        ("chair_1", table_x - 0.62, table_z - 0.38, 86.0),
        ("chair_2", table_x - 0.56, table_z + 0.42, 94.0),
        ("chair_3", table_x + 0.6, table_z + 0.36, -90.0),
        ("chair_4", table_x + 0.02, table_z - 1.06, 4.0),
    ):
        things += at(furnishings.chair(name), (x, 0.0, z), turn("y", yaw_deg))
    things += at([furnishings.copper_teapot()], (table_x - 0.08, on_table, table_z - 0.28), turn("y", -35))
    things += at([furnishings.vase("vase", "ceramic")], (table_x + 0.12, on_table, table_z + 0.12))
    things += at(furnishings.bowl(), (table_x - 0.1, on_table, table_z + 0.5))
    things += at(furnishings.pendant(HEIGHT - 1.75), (table_x, 1.75, table_z))
    things += at(furnishings.sofa(), (-0.35, 0.0, -Z + 0.47))
    things += at([furnishings.rug()], (-0.35, 0.0, -1.45))
    things += at(furnishings.picture(), (-0.35, 1.55, -Z))
    things += at(furnishings.plinth(), (1.75, 0.0, -2.45), turn("y", 20))
    things += at(furnishings.sideboard(), SIDEBOARD)
    things += at([furnishings.brushed_plate()], (-X, 1.42, SIDEBOARD[2]))
    things += at(
        [furnishings.vase("vase_small", "ceramic_blue", 0.7, 40, 2)],
        (-X + 0.2, on_sideboard - 0.0005, SIDEBOARD[2] - 0.62),
    )
    things += at(furnishings.books_lying(), (-X + 0.22, on_sideboard, SIDEBOARD[2] + 0.55))
    things += at(furnishings.screen(), (-1.35, 0.0, 2.38))
    things += at(furnishings.shelf(), (-1.35, 0.0, Z - 0.016))
    on_shelf = furnishings.SHELF_HIGH - 0.0005
    things += at([furnishings.vase("vase_red", "ceramic_red", 1.15, 40, 2)], (-1.13, on_shelf, Z - 0.17))
    things += at(furnishings.shelf_lamp(), (-1.62, on_shelf, Z - 0.17))
    return tuple(things)
