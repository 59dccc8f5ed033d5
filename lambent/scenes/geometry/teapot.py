"""Martin Newell's teapot (1975): 32 bicubic Bezier patches, from the few numbers that define them by symmetry.

Body, rim, lid and bottom are surfaces of revolution in four quarters, the control points of a circle of radius r at
handle length KAPPA r. Handle and spout are mirror images: a row of four control points is an inner and an outer point
of the mirror plane, each with a copy at a half width from it. The tables have Newell's units and axes, z up.
"""

from __future__ import annotations

import numpy as np

from lambent.core.geometry.directions import Floats, normalize
from lambent.scenes.geometry import bezier
from lambent.scenes.geometry.grid import grid, merge, transformed
from lambent.scenes.geometry.shapes import lathe
from lambent.scenes.mesh import Mesh

KAPPA = 0.56  # Newell's handle length of a quarter circle, by radius
KNOB_PULL = 0.45  # the handle length of one circle that differs: the lid's knob, radius .8
LENGTH = 6.525  # handle to spout, in the table's units

# (radius, height) of the control circles, four to a patch, neighbours sharing one; from the rim down and outwards.
TURNED: dict[str, tuple[tuple[float, float], ...]] = {
    "rim": ((1.4, 2.4), (1.3375, 2.53125), (1.4375, 2.53125), (1.5, 2.4)),
    "body": ((1.5, 2.4), (1.75, 1.875), (2.0, 1.35), (2.0, 0.9), (2.0, 0.45), (1.5, 0.225), (1.5, 0.15)),
    "lid": ((0.0, 3.15), (0.8, 3.15), (0.0, 2.85), (0.2, 2.7), (0.4, 2.55), (1.3, 2.55), (1.3, 2.4)),
    "bottom": ((1.5, 0.15), (1.5, 0.075), (1.425, 0.0), (0.0, 0.0)),
}
# (inner x, inner z, outer x, outer z, half width) of the control rows along handle and spout.
MIRRORED: dict[str, tuple[tuple[float, float, float, float, float], ...]] = {
    "handle": (
        (-1.6, 2.025, -1.5, 2.25, 0.3),
        (-2.3, 2.025, -2.5, 2.25, 0.3),
        (-2.7, 2.025, -3.0, 2.25, 0.3),
        (-2.7, 1.8, -3.0, 1.8, 0.3),
        (-2.7, 1.575, -3.0, 1.35, 0.3),
        (-2.5, 1.125, -2.65, 0.9375, 0.3),
        (-2.0, 0.9, -1.9, 0.6, 0.3),
    ),
    "spout": (
        (1.7, 1.425, 1.7, 0.6, 0.66),
        (2.6, 1.425, 3.1, 0.825, 0.66),
        (2.3, 2.1, 2.4, 2.025, 0.25),
        (2.7, 2.4, 3.3, 2.4, 0.25),
        (2.8, 2.475, 3.525, 2.49375, 0.25),
        (2.9, 2.475, 3.45, 2.5125, 0.15),
        (2.8, 2.4, 3.2, 2.4, 0.15),
    ),
}


def _quarters(circles: tuple[tuple[float, float], ...]) -> list[Floats]:
    """Four patches (4, 4, 3) for four control circles."""
    row = np.array([[1, 0], [1, -KAPPA], [KAPPA, -1], [0, -1]], float)
    knob = np.array([[0.8, 0], [0.8, -KNOB_PULL], [KNOB_PULL, -0.8], [0, -0.8]])
    points = np.empty((4, 4, 3))
    for i, (radius, height) in enumerate(circles):
        points[i, :, :2] = knob if radius == 0.8 else radius * row
        points[i, :, 2] = height
    quarter = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # row vectors: x to y to -x
    return [points @ np.linalg.matrix_power(quarter, k) for k in range(4)]


def _halves(rows: tuple[tuple[float, float, float, float, float], ...]) -> list[Floats]:
    """The two mirrored patches (4, 4, 3) for four control rows; both run round the section the same way."""
    near = np.array(
        [[(xi, 0, zi), (xi, -w, zi), (xo, -w, zo), (xo, 0, zo)] for xi, zi, xo, zo, w in rows],
        float,
    )
    return [near, (near * (1, -1, 1))[:, ::-1]]


def patches() -> dict[str, list[Floats]]:
    """Control points (4, 4, 3) of the 32 patches by part, in Newell's units, z up; rows run along the profile."""
    turned = {
        part: [p for start in range(0, len(c) - 1, 3) for p in _quarters(c[start : start + 4])]
        for part, c in TURNED.items()
    }
    mirrored = {
        part: [p for start in range(0, len(r) - 1, 3) for p in _halves(r[start : start + 4])]
        for part, r in MIRRORED.items()
    }
    return turned | mirrored


def evaluate(points: Floats, steps: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Positions, normals, and the directions along and across, (N, N, 3) each, N = steps + 1, of one patch (4, 4, 3).

    Where a whole row of control points is one point (a pole), the normal is that of the axis: the derivative across
    is zero there, and that of its neighbour row takes its place in the limit.
    """
    t = np.linspace(0, 1, steps + 1)
    b, db = bezier.bernstein(t), bezier.bernstein_slopes(t)
    positions, along, across = (np.einsum("ui,vj,ijk->uvk", u, v, points) for u, v in ((b, b), (db, b), (b, db)))
    for row, neighbour in ((0, 1), (3, 2)):
        if np.ptp(points[row], axis=0).max() == 0:
            across[0 if row == 0 else -1] = np.einsum("vj,jk->vk", db, points[neighbour])
    return positions, normalize(np.cross(across, along)), along, across


def teapot(length: float = 0.25, steps: int = 12) -> Mesh:
    """The teapot standing on the origin, y up, spout towards +x, `length` metres from handle to spout.

    `steps` quads along each side of a patch. Brushed round the body, and along handle and spout.
    """
    return merge(teapot_parts(length, steps).values())


def lid_seat(length: float) -> Mesh:
    """The ring that closes the gap round the lid of a `teapot`."""
    unit = length / LENGTH
    return lathe([[(1.42 * unit, 2.385 * unit), (1.28 * unit, 2.385 * unit)]], 72)


def teapot_parts(length: float = 0.25, steps: int = 12) -> dict[str, Mesh]:
    """The parts of `teapot`: rim, body, knob, lid, bottom, handle, spout."""
    parts: dict[str, list[Mesh]] = {}
    uv = np.stack(np.meshgrid(*[np.linspace(0, 1, steps + 1)] * 2, indexing="ij"), axis=-1)
    for part, members in patches().items():
        for i, points in enumerate(members):
            positions, normals, along, across = evaluate(points, steps)
            name = "knob" if part == "lid" and i < 4 else part
            sheet = grid(positions, normals, across if part in TURNED else along, uv)
            parts.setdefault(name, []).append(sheet)
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]) * length / LENGTH  # z up to y up
    return {name: transformed(merge(sheets), matrix) for name, sheets in parts.items()}
