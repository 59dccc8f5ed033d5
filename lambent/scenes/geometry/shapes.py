"""Shapes with analytic normals: y up, metres, standing on or centred at the origin; smooth curves through points."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from lambent.core.geometry.directions import Floats, normalize
from lambent.scenes.geometry.grid import build, grid, merge
from lambent.scenes.scene import Mesh

CubeSide = Callable[[Floats, Floats], tuple[Floats, Floats]]


def _cube(side: CubeSide, steps: Sequence[Floats], brushed: ArrayLike, size: ArrayLike) -> Mesh:
    """The six sides of a cube: `side` maps face parameters (R, C, 3) in [-1, 1]^3 to positions and normals.

    `steps[i]` are the parameters of the grid lines along axis i, ascending from -1 to 1.
    """
    half = np.asarray(size, float) / 2
    sheets = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for sign in (-1.0, 1.0):
            p = np.empty((len(steps[u]), len(steps[v]), 3))
            p[..., axis], p[..., u], p[..., v] = sign, steps[u][:, None], steps[v][None, :]
            positions, normals = side(p, half)
            sheets.append(grid(positions, normals, brushed, np.stack([positions[..., u], positions[..., v]], -1)))
    return merge(sheets)


def box(size: ArrayLike, bevel: float = 0.0, brushed: ArrayLike = (1, 0, 0), segments: int = 1) -> Mesh:
    """Box of `size` (3,) centred at the origin, edges rounded with radius `bevel`; uv in metres.

    The rounding is a fillet with smooth normals, `segments` quads on each side of an edge; the six sides have flat
    normals. Without a bevel the edges are hard.
    """
    if bevel == 0:
        flat = [np.array([-1.0, 1.0])] * 3
        return _cube(lambda p, half: (p * half, p * _face_axis(p)), flat, brushed, size)
    # Grid lines beyond |p| = 1 are the fillet's: |p| - 1 is the tangent of the angle from the flat side.
    angles = np.tan(np.linspace(0, np.pi / 4, segments + 1))
    lines = np.concatenate([-1 - angles[::-1], 1 + angles])

    def fillet(p: Floats, half: Floats) -> tuple[Floats, Floats]:
        flat = _face_axis(p)
        slope = np.sign(p) * np.where(flat, 1.0, np.abs(p) - 1)
        normals = normalize(slope)
        return np.sign(p) * (half - bevel) + bevel * normals, normals

    return _cube(fillet, [lines] * 3, brushed, size)


def _face_axis(p: Floats) -> Floats:
    """1 along the axis on which a cube's side is constant, else 0; p (R, C, 3)."""
    axis = next(i for i in range(3) if np.ptp(p[..., i]) == 0)
    return np.broadcast_to(np.eye(3)[axis], p.shape)


def cushion(size: ArrayLike, exponent: float = 4.0, steps: int = 12, brushed: ArrayLike = (1, 0, 0)) -> Mesh:
    """Superellipsoid |x/a|^e + |y/b|^e + |z/c|^e = 1 of `size` (3,), centred: an inflated box, without poles."""
    lines = np.sin(np.linspace(-np.pi / 2, np.pi / 2, 2 * steps + 1))

    def puff(p: Floats, half: Floats) -> tuple[Floats, Floats]:
        unit = p / np.sum(np.abs(p) ** exponent, axis=-1, keepdims=True) ** (1 / exponent)
        return unit * half, normalize(np.sign(unit) * np.abs(unit) ** (exponent - 1) / half)

    return _cube(puff, [lines] * 3, brushed, size)


def lathe(profiles: Sequence[ArrayLike], around: int = 48, rows: int = 6) -> Mesh:
    """Surface of revolution about y: brushed round the axis, uv (turn, height share), edges hard between profiles.

    Each profile is a smooth curve through points (K, 2) of radius and height; one of two points is straight. The
    outside is to its right in the (radius, height) plane: outer walls run from bottom to top, inner ones from top to
    bottom. `rows` quads lie between two points.
    """
    turns = np.linspace(0, 2 * np.pi, around + 1)
    circle = np.stack([np.cos(turns), np.zeros_like(turns), -np.sin(turns)], axis=-1)
    circle[-1] = circle[0]
    round_axis = np.stack([-np.sin(turns), np.zeros_like(turns), -np.cos(turns)], axis=-1)
    sheets = []
    for profile in profiles:
        points = np.asarray(profile, float)
        (radius, height), (dr, dh) = (c.T for c in smooth_curve(points, rows if len(points) > 2 else 1))
        radius = np.where(radius < 1e-9, 0.0, radius)
        up = np.array([0.0, 1.0, 0.0])
        positions = radius[:, None, None] * circle + height[:, None, None] * up
        normals = dh[:, None, None] * circle - dr[:, None, None] * up
        share = np.linspace(0, 1, len(radius))
        uv = np.stack(np.broadcast_arrays(turns[None, :] / (2 * np.pi), share[:, None]), axis=-1)
        sheets.append(grid(positions, normals, np.broadcast_to(round_axis, positions.shape), uv))
    return merge(sheets)


def sphere(radius: float, around: int = 64, rows: int = 32) -> Mesh:
    """Sphere centred at the origin, brushed along its circles of latitude."""
    theta = np.linspace(0, np.pi, rows + 1)[:, None]
    phi = np.linspace(0, 2 * np.pi, around + 1)[None, :]
    sin_theta = np.where(np.isin(np.arange(rows + 1), (0, rows))[:, None], 0.0, np.sin(theta))
    cos_phi, sin_phi = np.cos(phi), np.where(np.arange(around + 1) == around, 0.0, np.sin(phi))
    normals = np.stack(np.broadcast_arrays(sin_theta * cos_phi, np.cos(theta), -sin_theta * sin_phi), axis=-1)
    around_axis = np.stack(np.broadcast_arrays(-sin_phi, 0.0, -cos_phi), axis=-1)
    uv = np.stack(np.broadcast_arrays(phi / (2 * np.pi), 1 - theta / np.pi), axis=-1)
    return grid(radius * normals, normals, np.broadcast_to(around_axis, normals.shape), uv)


def cylinder(radius: float, height: float, around: int = 32, bevel: float = 0.0) -> Mesh:
    """Upright cylinder standing on the origin, its rims rounded with radius `bevel`."""
    if bevel == 0:
        return lathe([[(0, 0), (radius, 0)], [(radius, 0), (radius, height)], [(radius, height), (0, height)]], around)
    arc = np.linspace(0, np.pi / 2, 4)
    low = [(radius - bevel + bevel * np.sin(a), bevel - bevel * np.cos(a)) for a in arc]
    high = [(r, height - y) for r, y in reversed(low)]
    parts = [[(0, 0), low[0]], low, [low[-1], high[0]], high, [high[-1], (0, height)]]
    return lathe(parts, around, rows=1)


def tube(
    points: Sequence[ArrayLike] | Floats, radius: float, around: int = 12, rows: int = 6, closed: bool = False
) -> Mesh:
    """Round tube along a smooth curve through `points` (K, 3), brushed lengthwise, its ends flat unless `closed`."""
    centres, along = smooth_curve(np.asarray(points, float), rows if closed or len(points) > 2 else 1, closed)
    along = normalize(along)
    side = normalize(np.cross(along[0], np.eye(3)[np.argmin(np.abs(along[0]))]))
    sides = [side]
    for tangent in along[1:]:  # parallel transport: no twist but the curve's own
        side = normalize(side - tangent * (side @ tangent))
        sides.append(side)
    twist = np.zeros(len(along))
    if closed:  # spread the twist of one round over the tube
        over = np.cross(along[0], sides[0])
        twist = np.linspace(0, -np.arctan2(sides[-1] @ over, sides[-1] @ sides[0]), len(along))
    a = np.stack(sides)
    b = np.cross(along, a)
    phi = np.linspace(0, 2 * np.pi, around + 1)[None, :] + twist[:, None]
    normals = np.cos(phi)[..., None] * a[:, None] + np.sin(phi)[..., None] * b[:, None]
    normals[:, -1] = normals[:, 0]
    positions = centres[:, None] + radius * normals
    if closed:
        positions[-1], normals[-1] = positions[0], normals[0]
    steps = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(centres, axis=0), axis=-1))])
    uv = np.stack(np.broadcast_arrays(radius * phi, steps[:, None]), axis=-1)
    body = grid(positions, normals, np.broadcast_to(along[:, None], positions.shape), uv)
    return body if closed else merge([body, fan(positions[0, :-1], -along[0]), fan(positions[-1, :-1], along[-1])])


def fan(rim: Floats, normal: ArrayLike, brushed: ArrayLike = (1, 0, 0)) -> Mesh:
    """Flat patch within a star-shaped rim (K, 3) about its mean; uv in metres."""
    n = np.asarray(normal, float)
    points = np.concatenate([rim.mean(axis=0, keepdims=True), rim])
    count = len(rim)
    faces = np.stack([np.zeros(count, int), 1 + np.arange(count), 1 + (np.arange(count) + 1) % count], axis=-1)
    u, v = (i for i in range(3) if i != int(np.argmax(np.abs(n))))
    return build(points, np.broadcast_to(n, points.shape), brushed, points[:, [u, v]], faces)


def extrusion(profile: ArrayLike, length: float, brushed: ArrayLike = (0, 0, 1)) -> Mesh:
    """Prism along z from 0 to `length` of a polygon (K, 2) in x, y, counter-clockwise, edges hard, ends closed.

    The polygon is star-shaped about its mean.
    """
    points = np.asarray(profile, float)

    def lift(xy: Floats, z: float) -> Floats:
        return np.concatenate([xy, np.full((len(xy), 1), z)], axis=-1)

    sides = []
    for p, q in zip(points, np.roll(points, -1, axis=0), strict=True):
        ends = np.stack([p, q])
        positions = np.stack([lift(ends, 0.0), lift(ends, length)])
        normal = np.array([q[1] - p[1], p[0] - q[0], 0.0])
        wide = float(np.linalg.norm(q - p))
        uv = np.array([[[0, 0], [wide, 0]], [[0, length], [wide, length]]], float)
        sides.append(grid(positions, np.broadcast_to(normal, positions.shape), brushed, uv))
    return merge([*sides, fan(lift(points, 0.0), (0, 0, -1)), fan(lift(points, length), (0, 0, 1))])


def patch(origin: ArrayLike, across: ArrayLike, up: ArrayLike, cells: tuple[int, int] = (1, 1)) -> Mesh:
    """Flat rectangle from `origin`, spanned by `across` and `up` (metres), facing across x up; uv in metres."""
    o, a, b = (np.asarray(x, float) for x in (origin, across, up))
    s, t = np.linspace(0, 1, cells[0] + 1), np.linspace(0, 1, cells[1] + 1)
    positions = o + s[:, None, None] * a + t[None, :, None] * b
    uv = np.stack(np.broadcast_arrays(s[:, None] * np.linalg.norm(a), t[None, :] * np.linalg.norm(b)), axis=-1)
    return grid(positions, np.broadcast_to(np.cross(a, b), positions.shape), a, uv)


def catmull_rom(points: Floats, t: Floats, closed: bool = False, knots: Floats | None = None) -> tuple[Floats, Floats]:
    """Position and derivative (N, D) at parameters t (N,) of the Catmull-Rom curve through `points` (K, D).

    The curve passes point k at t = knots[k], by default k (Catmull & Rom 1974). An open curve ends straight; a closed
    one returns to its first point a step of 1 after the last.
    """
    if knots is None:
        knots = np.arange(len(points), dtype=float)
    if closed:
        points = np.concatenate([points, points[:1]])
        knots = np.append(knots, knots[-1] + 1)
    step = np.diff(knots)[:, None]
    slope = np.diff(points, axis=0) / step
    if closed:
        before, after = np.concatenate([slope[-1:], slope]), np.concatenate([slope, slope[:1]])
        d0, d1 = np.concatenate([step[-1:], step]), np.concatenate([step, step[:1]])
    else:
        before, after = np.concatenate([slope[:1], slope]), np.concatenate([slope, slope[-1:]])
        d0, d1 = np.concatenate([step[:1], step]), np.concatenate([step, step[-1:]])
    tangents = (before * d1 + after * d0) / (d0 + d1)
    k = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, len(step) - 1)
    d = step[k]
    s = (t[:, None] - knots[k][:, None]) / d
    p0, p1, m0, m1 = points[k], points[k + 1], d * tangents[k], d * tangents[k + 1]
    a, b = 2 * (p0 - p1) + m0 + m1, 3 * (p1 - p0) - 2 * m0 - m1
    return p0 + s * (m0 + s * (b + s * a)), (m0 + s * (2 * b + 3 * s * a)) / d


def centripetal_knots(points: Floats) -> Floats:
    """Knots (K,) that keep a curve through unevenly spaced points free of loops (Yuksel et al. 2011).

    Steps grow with the square root of the distance, and are at least a quarter of their mean, so that coincident points
    take a finite time.
    """
    root = np.sqrt(np.linalg.norm(np.diff(points, axis=0), axis=-1))
    mean = float(root.mean()) or 1.0
    return np.concatenate([[0.0], np.cumsum(np.maximum(root, mean / 4))])


def smooth_curve(points: Floats, steps: int, closed: bool = False) -> tuple[Floats, Floats]:
    """Positions and derivatives at `steps` equal parameter steps between neighbours, ends included."""
    count = len(points) if closed else len(points) - 1
    return catmull_rom(points, np.linspace(0, count, count * steps + 1), closed)
