"""A vase with flowers on a wooden table, after figure 6.3 of Ben-Artzi 2007 ("Vase with Flowers").

The lights, the other materials and the camera are in vase.toml.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from lambent.core.geometry.directions import Floats, normalize
from lambent.materials.document import Lobe, Material
from lambent.scenes.builtin.things import block, of_one_colour, painted, thing, wood
from lambent.scenes.geometry import cushion, grid, lathe, merge, placed, transformed, tube, turn
from lambent.scenes.scene import MaterialTextures, Mesh, SceneObject

HALF, THICK, BEVEL = 0.3, 0.025, 0.006  # half the side of the table, its thickness, its rounded edge, metres
BOARDS_M = (0.8, 0.4)  # what one repetition of the grain covers, along and across
STEM = 0.0026  # radius
# (height, lean in degrees, direction of the lean, scale) of the flowers
FLOWERS = ((0.385, 4.0, 20.0, 1.05), (0.335, 19.0, 75.0, 0.9), (0.345, 17.0, 150.0, 1.0), (0.31, 24.0, 215.0, 0.85),
           (0.33, 20.0, 290.0, 0.95), (0.295, 27.0, 345.0, 0.9))  # fmt: skip
# (direction, lean in degrees, length) of the leaves
LEAVES = ((30.0, 34.0, 0.11), (120.0, 38.0, 0.1), (190.0, 30.0, 0.12), (255.0, 38.0, 0.1), (320.0, 34.0, 0.11))
MOUTH = 0.2  # height of the vase
STEP = 1e-4  # of the finite differences that give a petal's normals


@cache
def objects() -> tuple[SceneObject, ...]:
    """The vase stands in the middle of the table, whose top is y = 0."""
    stems, heads = [], []
    for height, lean_deg, towards_deg, scale in FLOWERS:
        lean, out = np.radians(lean_deg), turn("y", -towards_deg) @ [1.0, 0.0, 0.0]
        off = np.array([-0.03, 0.04, 0.055, 0.0]) * np.sin(lean)  # the stem passes the neck and leans on the lip
        off[3] = 0.6 * height * np.sin(1.4 * lean)
        up = [0.04, MOUTH - 0.028, MOUTH + 0.01, height - 0.004]
        points = [x * out + np.array([0, y, 0]) for x, y in zip(off, up, strict=True)]
        stems.append(tube(points, STEM, 14, 8))
        tilt = turn("y", -towards_deg) @ turn("z", -1.6 * lean_deg - 8)
        heads.append(placed(_flower(scale), points[-1], tilt))
    for towards_deg, lean_deg, length in LEAVES:
        leaf = placed(_petal(length, 0.016, 0.0012, 0.9), rotation=turn("z", 90 - lean_deg))
        stems.append(placed(leaf, turn("y", -towards_deg) @ [0.006, MOUTH - 0.024, 0.0], turn("y", -towards_deg)))
    top = block((-HALF, -THICK, -HALF), (HALF, 0.0, HALF), BEVEL, segments=3)
    return (
        thing("table", "table", top),
        thing("vase", "vase", _vase()),
        thing("stems", "stems", *stems),
        thing("flowers", "flowers", *heads),
    )


@cache
def textured() -> dict[str, tuple[Material, MaterialTextures]]:
    """The table with its grain, and the flowers, whose colour changes from their middles outwards."""
    varnish = Lobe(mx=0.1, my=0.1, r0=(0.05,) * 3, alpha=0.5)
    at = np.linspace(0, 1, 64)[:, None, None]
    petal = np.where(at < 0.22, [0.62, 0.4, 0.06], [0.62, 0.1, 0.2] + (at - 0.22) * [0.1, 0.32, 0.34])
    boards = ((1 / BOARDS_M[0], 0.0, 0.5), (0.0, 1 / BOARDS_M[1], 0.5))
    return {"table": painted("table", wood(), varnish, uv_transform=boards), "flowers": painted("flowers", petal[::-1])}


def _vase() -> Mesh:
    """Vase with a foot, a lip and an inside."""
    outside = [(0.036, 0.003), (0.04, 0.012), (0.058, 0.06), (0.06, 0.095), (0.042, 0.145), (0.028, 0.172),
               (0.031, 0.191), (0.04, MOUTH - 0.0012)]  # fmt: skip
    lip = [outside[-1], (0.0392, MOUTH), (0.0378, MOUTH - 0.0009)]
    inside = [lip[-1], (0.0285, 0.19), (0.0255, 0.172), (0.039, 0.144), (0.0565, 0.095), (0.052, 0.055), (0.037, 0.022),
              (0.0, 0.012)]  # fmt: skip
    foot = [(0.033, 0.0), (0.0352, 0.0008), outside[0]]
    return lathe([[(0.0, 0.0), foot[0]], foot, outside, lip, inside], 96, 6)


def _flower(scale: float) -> Mesh:
    """Two whorls of petals about a round middle, the flower's axis along y."""
    middle = placed(cushion((0.017, 0.009, 0.017), 2.2, 6), (0, 0.0035, 0))
    petals = []
    for count, length, rise_deg, lift, first_deg in ((9, 0.044, 14.0, 0.0, 0.0), (7, 0.033, 38.0, 0.0022, 25.0)):
        petal = placed(_petal(length, 0.42 * length / 2, 0.0007, -0.5), (0.003, lift, 0), turn("z", rise_deg))
        petals += [placed(petal, rotation=turn("y", first_deg + k * 360 / count)) for k in range(count)]
    whole = merge([of_one_colour(middle, 0.5, 0.1), *petals])
    return transformed(whole, np.diag([scale, scale, scale, 1.0]))


def _petal(length: float, half_width: float, half_thick: float, bend_rad: float) -> Mesh:
    """A closed, thin blade from the origin along x, its upper side towards y, bent down by an angle.

    Its outline widens late, as a petal's does. v of its uv is the way along it.
    """

    def points(s: Floats, phi: Floats) -> Floats:
        angle = bend_rad * s
        wide = half_width * np.sin(np.pi * s**0.8) ** 0.75 * (0.75 + 0.35 * s)
        thick = half_thick * np.sin(np.pi * s) ** 0.5
        across, off = wide * np.cos(phi), thick * np.sin(phi) + 0.2 * wide * np.cos(phi) ** 2
        x, y = np.sin(angle) / bend_rad, (np.cos(angle) - 1) / bend_rad
        return np.stack([length * x + off * np.sin(angle), length * y + off * np.cos(angle), across], axis=-1)

    s = (0.5 - 0.5 * np.cos(np.linspace(0, np.pi, 13)))[:, None]
    phi = np.linspace(0, 2 * np.pi, 25)[None, :]
    positions = points(*np.broadcast_arrays(s, phi))
    positions[:, -1] = positions[:, 0]
    inner = np.clip(s, 0.02, 0.98)  # the normals of the ends are those of their neighbourhood
    along = points(inner + STEP, phi + 0 * s) - points(inner - STEP, phi + 0 * s)
    around = points(inner + 0 * phi, phi + STEP) - points(inner + 0 * phi, phi - STEP)
    normals = normalize(np.cross(along, around))
    normals[:, -1] = normals[:, 0]
    uv = np.stack(np.broadcast_arrays(0.5 + 0 * phi, 0.03 + 0.94 * s), axis=-1)
    return grid(positions, normals, (1, 0, 0), uv)
