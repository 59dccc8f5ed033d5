"""A room with a couch, stairs and windows, after figure 6.1 of Ben-Artzi 2007 ("Room").

Daylight enters through three windows alone, so that most of the room is lit by its own surfaces. Books and toys are
fixed; the other six materials are meant for editing. Lights, the other materials and the camera are in loft.toml.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from lambent.materials.document import Lobe, Material
from lambent.scenes.builtin import furnishings
from lambent.scenes.builtin.things import at, block, of_one_colour, painted, thing, wood
from lambent.scenes.geometry import box, cylinder, patch, placed, sphere, tube, turn
from lambent.scenes.scene import MaterialTextures, Mesh, SceneObject

X, Z, HEIGHT, THICK = 2.7, 2.9, 2.8, 0.25  # half width, half depth, height, thickness of the walls, metres
WINDOWS_Z = ((-2.1, -0.9), (-0.5, 0.7), (1.1, 2.3))
WINDOW_Y = (0.85, 2.45)
LAP = THICK / 2  # how far floor, ceiling and walls reach into each other
STEPS, RISE, GO, STAIRS_X, STAIRS_Z = 6, 0.165, 0.27, 0.75, -1.75  # the first step begins at x, all end at z
TABLE_HIGH = 0.4
BOARDS_M = (2.4, 1.2)  # what one repetition of the grain covers on the floor
COLOURS = {
    "books": np.array([[0.42, 0.05, 0.04], [0.06, 0.12, 0.32], [0.5, 0.33, 0.07], [0.7, 0.66, 0.56]]),
    "toys": np.array([[0.6, 0.06, 0.05], [0.07, 0.35, 0.1], [0.08, 0.18, 0.55], [0.7, 0.5, 0.06]]),
}


@cache
def objects() -> tuple[SceneObject, ...]:
    """The room about the axis of y, its floor in y = 0, its windows towards -x."""
    couch = [o.mesh for o in furnishings.sofa() if o.name != "sofa_feet"]
    feet = [o.mesh for o in furnishings.sofa() if o.name == "sofa_feet"]
    couch_at, turned = (-0.75, 0.0, -1.95), turn("y", 6)
    return (
        thing("floor", "floor", block((-X - LAP / 2, -THICK, -Z - LAP / 2), (X + LAP / 2, 0.0, Z + LAP / 2))),
        *_walls(),
        *(thing(f"sill_{k}", "sills", *_sill(*z)) for k, z in enumerate(WINDOWS_Z, start=1)),
        thing("stairs", "stairs", *_stairs()),
        *at([thing("couch", "couch", *couch), thing("couch_feet", "table", *feet)], couch_at, turned),
        *at(_table(), (0.25, 0.0, 0.05), turn("y", -8)),
    )


@cache
def textured() -> dict[str, tuple[Material, MaterialTextures]]:
    """The floor with its grain; the books and the toys, whose colours are the texels of a row."""
    varnish = Lobe(mx=0.1, my=0.1, r0=(0.06,) * 3, alpha=0.5)
    boards = ((0.0, 1 / BOARDS_M[0], 0.0), (1 / BOARDS_M[1], 0.0, 0.0))
    rows = {name: painted(name, colours[None]) for name, colours in COLOURS.items()}
    return {"floor": painted("floor", wood(), varnish, uv_transform=boards), **rows}


def _walls() -> list[SceneObject]:
    """Three walls and a ceiling without openings, and the one with windows."""
    low, top = -LAP, HEIGHT + LAP
    return [
        thing("ceiling", "walls", block((-X - LAP, HEIGHT, -Z - LAP), (X + LAP, HEIGHT + THICK, Z + LAP))),
        thing("wall_back", "walls", block((-X - LAP, low, -Z - THICK), (X + LAP, top, -Z))),
        thing("wall_front", "walls", block((-X - LAP, low, Z), (X + LAP, top, Z + THICK))),
        thing("wall_right", "walls", block((X, low, -Z - LAP), (X + THICK, top, Z + LAP))),
        thing("wall_windows", "walls", *_with_windows((low, top), (-Z - LAP, Z + LAP))),
    ]


def _with_windows(y: tuple[float, float], z: tuple[float, float]) -> list[Mesh]:
    """The wall at -x, closed: its two sides, its edges and the reveals of its windows."""
    ys, zs = (y[0], *WINDOW_Y, y[1]), (z[0], *(edge for window in WINDOWS_Z for edge in window), z[1])
    solid = np.zeros((len(ys) + 1, len(zs) + 1), bool)  # fields between the lines, and a rim of air
    solid[1:-1, 1:-1] = True
    solid[2, 2:-1:2] = False
    deep, parts = (THICK, 0.0, 0.0), []
    for i, j in zip(*np.nonzero(solid), strict=True):
        (y0, y1), (z0, z1), x0 = ys[i - 1 : i + 1], zs[j - 1 : j + 1], -X - THICK
        high, wide = (0.0, y1 - y0, 0.0), (0.0, 0.0, z1 - z0)
        parts += [patch((-X, y0, z0), high, wide), patch((x0, y0, z0), wide, high)]
        edges = (
            (i - 1, j, patch((x0, y0, z0), deep, wide)),
            (i + 1, j, patch((x0, y1, z0), wide, deep)),
            (i, j - 1, patch((x0, y0, z0), high, deep)),
            (i, j + 1, patch((x0, y0, z1), deep, high)),
        )
        parts += [edge for row, column, edge in edges if not solid[row, column]]
    return parts


def _sill(z0: float, z1: float) -> list[Mesh]:
    """Board under a window, wider than it and held by the wall, and the bars of the window."""
    (y0, y1), middle, x = WINDOW_Y, (z0 + z1) / 2, -X - 0.15
    return [
        block((x, y0 - 0.03, z0 - 0.05), (-X + 0.22, y0 + 0.015, z1 + 0.05), 0.006, (0, 0, 1), 2),
        block((x - 0.03, y0 - 0.03, middle - 0.03), (x + 0.03, y1 + 0.03, middle + 0.03), 0.004, (0, 1, 0)),
        block((x - 0.02, 1.8, z0 - 0.03), (x + 0.02, 1.85, z1 + 0.03), 0.004, (0, 0, 1)),
    ]


def _stairs() -> list[Mesh]:
    """Slabs, each on the one below and into the walls; their fronts stand back a little, so that none share a plane."""
    return [
        block(
            (STAIRS_X + k * GO, k * RISE - 0.02, -Z - 0.05),
            (X + 0.05, (k + 1) * RISE, STAIRS_Z - 0.003 * k),
            0.008,
            segments=2,
        )
        for k in range(STEPS)
    ]


def _table() -> list[SceneObject]:
    """A low table with a pile of books and some toys on it."""
    legs = [
        placed(cylinder(0.022, TABLE_HIGH - 0.02, 24, 0.002), (x, 0, z)) for x in (-0.44, 0.44) for z in (-0.22, 0.22)
    ]
    top = block((-0.5, TABLE_HIGH - 0.035, -0.28), (0.5, TABLE_HIGH, 0.28), 0.008, segments=3)
    books = [of_one_colour(o.mesh, (k + 0.5) / 4, 0.5) for k, o in enumerate(furnishings.books_lying())]
    pile = at([thing("books", "books", *books)], (-0.26, TABLE_HIGH, 0.02), turn("y", 70))
    return [thing("table", "table", top, *legs), *pile, *at([thing("toys", "toys", *_toys())], (0.0, TABLE_HIGH, 0.0))]


def _toys() -> list[Mesh]:
    """Four building blocks, a ball and a ring, each of one colour."""
    side = 0.055
    ring = [(0.04 * np.cos(a), 0.0, 0.04 * np.sin(a)) for a in np.arange(12) * np.pi / 6]
    cubes = [
        (0, (0.06, side / 2, 0.06), 25.0),
        (1, (0.13, side / 2, 0.02), -12.0),
        (2, (0.095, 1.5 * side, 0.04), 8.0),
        (3, (0.05, side / 2, -0.07), 50.0),
    ]
    placed_cubes = [(k, placed(box((side,) * 3, 0.003, segments=2), p, turn("y", yaw))) for k, p, yaw in cubes]
    others = [
        (0, placed(sphere(0.045, 48, 24), (0.27, 0.045, -0.06))),
        (2, placed(tube(ring, 0.014, 20, 4, closed=True), (0.33, 0.014, 0.1))),
        (3, placed(sphere(0.03, 40, 20), (0.2, 0.03, 0.13))),
    ]
    return [of_one_colour(mesh, (k + 0.5) / 4, 0.5) for k, mesh in [*placed_cubes, *others]]
