"""Bicubic Bezier patches: position, derivatives and normal, and meshes of them.

Control points are (..., 4, 4, 3), those of a row along u, rows along v, as in files of patches. S(u, v) = sum over i, j
of B_i(v) B_j(u) P_ij with u and v from 0 to 1; the normal is along S_u x S_v. Control points broadcast with u and v.

Meshes have no cracks: the steps along an edge depend on its own control points alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags, Floats, Indices
from lambent.scenes.geometry.grid import build
from lambent.scenes.mesh import Mesh

INWARDS = 1e-3  # share of the way to the middle of a patch where derivatives at a pole are taken instead
NO_NORMAL = 1e-7  # of |S_u x S_v|, relative to the squared size of a patch: below it, the limit from inside
MOST_STEPS = 64  # along a side; a power of two, at which shared edges are bitwise equal
POINTS_AT_ONCE = 1 << 18
COINCIDENT = 1e-9  # of the box of all patches, within which control points are one
SIDES = "v = 0", "v = 1", "u = 0", "u = 1"  # the order of edges below
_MIXING = np.random.default_rng(0).integers(-(2**63), 2**63, 12) | 1
Steps = NDArray[np.int64]  # (n, 6): inner steps along u and v, then those of the four edges


def bernstein(t: Floats) -> Floats:
    """Cubic Bernstein polynomials (..., 4); exact for t = k/2^n, n up to 16."""
    s = 1 - t
    return np.stack([s**3, 3 * t * s**2, 3 * t**2 * s, t**3], axis=-1)


def bernstein_slopes(t: Floats) -> Floats:
    """First derivatives (..., 4) of `bernstein`."""
    s = 1 - t
    return np.stack([-3 * s**2, 3 * s * (s - 2 * t), 3 * t * (2 * s - t), 3 * t**2], axis=-1)


def _bernstein_bends(t: Floats) -> Floats:
    """Second derivatives (..., 4) of `bernstein`."""
    s = 1 - t
    return np.stack([6 * s, 6 * (t - 2 * s), 6 * (s - 2 * t), 6 * t], axis=-1)


def _blend(points: Floats, weights: Floats) -> Floats:
    """Weighted sum of points (..., 4, 3): bitwise the same if both are reversed, so that shared edges coincide."""
    w = weights[..., None]
    outer = w[..., 0, :] * points[..., 0, :] + w[..., 3, :] * points[..., 3, :]
    inner = w[..., 1, :] * points[..., 1, :] + w[..., 2, :] * points[..., 2, :]
    return np.asarray(outer + inner)


def _surface(control: Floats, along_u: Floats, along_v: Floats) -> Floats:
    """Control points weighted along u and v, weights (..., 4) each."""
    return _blend(_blend(control, along_u[..., None, :]), along_v)


def positions(control: Floats, u: Floats, v: Floats) -> Floats:
    """Points S (..., 3). Those of edges that patches share are bitwise equal at k/2^n, n up to 16."""
    return _surface(control, bernstein(u), bernstein(v))


def tangents(control: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """First derivatives S_u and S_v, (..., 3) each."""
    return (
        _surface(control, bernstein_slopes(u), bernstein(v)),
        _surface(control, bernstein(u), bernstein_slopes(v)),
    )


def bends(control: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
    """Second derivatives S_uu, S_uv and S_vv, (..., 3) each."""
    b_u, b_v = bernstein(u), bernstein(v)
    return (
        _surface(control, _bernstein_bends(u), b_v),
        _surface(control, bernstein_slopes(u), bernstein_slopes(v)),
        _surface(control, b_u, _bernstein_bends(v)),
    )


def normals(control: Floats, u: Floats, v: Floats) -> Floats:
    """Unit normals (..., 3) along S_u x S_v; 0 for patches without area.

    Where the tangents vanish or are parallel, as at the pole of a collapsed edge, the normal is its limit from inside
    the patch, to first order: the derivative of S_u x S_v towards the middle.
    """
    across = np.cross(*tangents(control, u, v))
    size = extents(control)[..., None]
    lost = np.linalg.norm(across, axis=-1, keepdims=True) <= NO_NORMAL * size**2
    if lost.any():
        limit = _normal_slopes(control, u, v)
        nudged = np.cross(*tangents(control, *_inwards(u, v)))
        known = np.linalg.norm(limit, axis=-1, keepdims=True) > NO_NORMAL * size**2
        across = np.where(lost, np.where(known, limit, nudged), across)
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    return np.asarray(np.where(length > 1e-14 * size**2, across / np.maximum(length, 1e-300), 0.0))


def _normal_slopes(control: Floats, u: Floats, v: Floats) -> Floats:
    """Derivative (..., 3) of S_u x S_v towards the middle of the patch."""
    (s_u, s_v), (s_uu, s_uv, s_vv) = tangents(control, u, v), bends(control, u, v)
    by_u = np.cross(s_uu, s_v) + np.cross(s_u, s_uv)
    by_v = np.cross(s_uv, s_v) + np.cross(s_u, s_vv)
    return np.asarray(by_u * (0.5 - u)[..., None] + by_v * (0.5 - v)[..., None])


def _inwards(u: Floats, v: Floats) -> tuple[Floats, Floats]:
    return u + INWARDS * (0.5 - u), v + INWARDS * (0.5 - v)


def extents(control: Floats) -> Floats:
    """Longest side (...) of the boxes of control points."""
    return np.asarray(np.ptp(control.reshape(*control.shape[:-3], 16, 3), axis=-2).max(axis=-1))


def elevated(points: Floats) -> Floats:
    """Control points (4, 4, 3) of the same surface as control points (p, q, 3) of degrees p - 1 and q - 1, up to 3."""
    for axis in (0, 1):
        points = np.moveaxis(points, axis, 0)
        while len(points) < 4:
            degree = len(points)  # after elevation
            share = (np.arange(degree + 1) / degree)[:, None, None]
            low = np.concatenate([points[:1], points])  # P_(i-1); the first counts with share 0
            high = np.concatenate([points, points[-1:]])
            points = share * low + (1 - share) * high
        points = np.moveaxis(points, 0, axis)
    return points


def steps_for(control: Floats, tolerance: float) -> tuple[Floats, Floats]:
    """How many equal steps along u and v, (...) each, keep triangles within `tolerance` of the surface.

    The error of a linear interpolant over steps h_u, h_v is at most (h_u^2 |S_uu| + 2 h_u h_v |S_uv| + h_v^2 |S_vv|)/8
    (Filip, Magedson & Markot 1986); second differences of control points bound the derivatives.
    """

    def most(differences: Floats, factor: float) -> Floats:
        return np.asarray(factor * np.linalg.norm(differences, axis=-1).max(axis=(-1, -2)))

    by_u, by_v = most(np.diff(control, 2, axis=-2), 6.0), most(np.diff(control, 2, axis=-3), 6.0)
    twist = most(np.diff(np.diff(control, axis=-2), axis=-3), 9.0)
    # a quarter of the tolerance for each of the first and the last term, half of it for the twist
    along_u, along_v = np.sqrt(by_u / (2 * tolerance)), np.sqrt(by_v / (2 * tolerance))
    along_u, along_v = np.maximum(along_u, 1.0), np.maximum(along_v, 1.0)
    more = np.sqrt(np.maximum(twist / (2 * tolerance) / (along_u * along_v), 1.0))
    return along_u * more, along_v * more


def steps_to(control: Floats, tolerance: float) -> Steps:
    """The steps that keep triangles within a distance of patches (n, 4, 4, 3), powers of two up to MOST_STEPS."""
    along_u, along_v = steps_for(control, tolerance)
    edges = np.stack([control[:, 0], control[:, 3], control[:, :, 0], control[:, :, 3]], axis=1)
    bend = 6 * np.linalg.norm(np.diff(edges, 2, axis=2), axis=-1).max(axis=-1)
    wanted = np.column_stack([along_u, along_v, np.sqrt(bend / (8 * tolerance))])
    steps = 2 ** np.ceil(np.log2(np.clip(wanted, 1, MOST_STEPS))).astype(np.int64)
    inner, sides = steps[:, :2], steps[:, 2:]
    is_grid = (sides == inner[:, [0, 0, 1, 1]]).all(axis=1)
    inner[~is_grid] = np.maximum(inner[~is_grid], 2)  # a strip along an edge needs something to lead to
    return np.concatenate([inner, sides], axis=1)


def triangles_of(steps: Steps) -> int:
    """How many triangles the steps make."""
    strips = np.where((steps[:, 2:] == steps[:, [0, 0, 1, 1]]).all(axis=1), 0, 1)
    inner = 2 * (steps[:, 0] - 2 * strips) * (steps[:, 1] - 2 * strips)
    ring = strips * (steps[:, 2:].sum(axis=1) + 2 * (steps[:, 0] - 2) + 2 * (steps[:, 1] - 2))
    return int((inner + ring).sum())


def tessellated(control: Floats, steps: int | Steps) -> Mesh:
    """The mesh of patches (n, 4, 4, 3), with exact normals outside along S_u x S_v, brushed along u.

    Parameters
    ----------
    control : (n, 4, 4, 3) control points, m; a patch with one that is not finite has no triangles.
    steps : along every side of every patch, or those of `steps_to`.

    Returns
    -------
    Mesh
        Its uv are the parameters of each patch. Triangles without area are left out; vertices of neighbouring patches
        coincide and are not shared.
    """
    if isinstance(steps, int):
        steps = np.full((len(control), 6), steps, np.int64)
    usable = np.asarray(np.isfinite(control).all(axis=(1, 2, 3)))
    parts = list(_groups(np.flatnonzero(usable), steps))
    uv = np.concatenate([np.zeros((0, 2)), *(np.tile(places, (len(mine), 1)) for mine, places, _ in parts)])
    number = np.concatenate([np.zeros(0, np.int64), *(np.repeat(mine, len(at)) for mine, at, _ in parts)])
    faces, first = [np.zeros((0, 3), np.int64)], 0
    for mine, places, corners in parts:
        begins = first + len(places) * np.arange(len(mine))
        faces.append((corners + begins[:, None, None]).reshape(-1, 3))
        first += len(mine) * len(places)
    points, outward, along = (np.zeros((len(uv), 3)) for _ in range(3))
    for begin in range(0, len(uv), POINTS_AT_ONCE):
        some = slice(begin, begin + POINTS_AT_ONCE)
        place = control[number[some]], uv[some, 0], uv[some, 1]
        points[some], outward[some] = positions(*place), normals(*place)
        along[some] = tangents(*place)[0]
    outward[(outward == 0).all(axis=1)] = (0.0, 1.0, 0.0)  # of patches without area, whose triangles are left out
    return build(points, outward, along, uv, np.concatenate(faces))


def _groups(numbers: Indices, steps: Steps) -> Iterator[tuple[Indices, Floats, Indices]]:
    """Patches with the same steps: their numbers, and places and triangles of each."""
    kinds, which = np.unique(steps[numbers], axis=0, return_inverse=True)
    order = np.argsort(which.reshape(-1), kind="stable")
    ends = np.cumsum(np.bincount(which.reshape(-1), minlength=len(kinds)))
    for kind, mine in zip(kinds.tolist(), np.split(numbers[order], ends[:-1]), strict=True):
        yield mine, *_pattern(*kind)


@cache
def _pattern(m: int, k: int, low: int, high: int, left: int, right: int) -> tuple[Floats, Indices]:
    """Places (K, 2) and triangles (F, 3) of a patch of m x k inner steps, and steps along its four edges."""
    if (low, high, left, right) == (m, m, k, k):
        return _grid(np.arange(m + 1) / m, np.arange(k + 1) / k)
    places, faces = _grid(np.arange(1, m) / m, np.arange(1, k) / k)
    found, triangles = [places], [faces]
    inner = np.arange((m - 1) * (k - 1)).reshape(k - 1, m - 1)
    start = len(places)
    for side, (count, rim) in enumerate(
        ((low, inner[0]), (high, inner[-1]), (left, inner[:, 0]), (right, inner[:, -1]))
    ):
        t = np.arange(count + 1) / count
        fixed = np.full(count + 1, float(side % 2))
        found.append(np.stack([t, fixed] if side < 2 else [fixed, t], axis=1))
        triangles.append(_strip(start + np.arange(count + 1), rim))
        start += count + 1
    return np.concatenate(found), np.concatenate(triangles)


def _grid(u: Floats, v: Floats) -> tuple[Floats, Indices]:
    places = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    at = np.arange(len(places)).reshape(len(v), len(u))
    a, b, c, d = (corner.ravel() for corner in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    return places, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def _strip(outer: Indices, inner: Indices) -> Indices:
    """Triangles (F, 3) between an edge and the row beside it, which begins and ends a step later and earlier."""
    triangles, i, j = [], 0, 0
    while i < len(outer) - 1 or j < len(inner) - 1:
        next_outer = (i + 1) / (len(outer) - 1) if i < len(outer) - 1 else np.inf
        next_inner = (j + 2) / (len(inner) + 1) if j < len(inner) - 1 else np.inf
        if next_outer <= next_inner:
            triangles.append((outer[i], outer[i + 1], inner[j]))
            i += 1
        else:
            triangles.append((outer[i], inner[j + 1], inner[j]))
            j += 1
    return np.array(triangles, np.int64).reshape(-1, 3)


def oriented_alike(control: Floats) -> Floats:
    """Patches (n, 4, 4, 3), those turned about whose normals point to the other side than those of their neighbours.

    Neighbours have the four control points of an edge in common. Of patches that hang together, those on the side of
    less area are turned, by reversing their u.
    """
    number, forward = _edges(control)
    pairs = _used_twice(number)
    neighbours: list[list[tuple[int, bool]]] = [[] for _ in control]
    for one, other in pairs.tolist():
        turned = bool(forward[one] == forward[other])  # both run along the edge the same way: one faces backwards
        neighbours[one // 4].append((other // 4, turned))
        neighbours[other // 4].append((one // 4, turned))
    flipped = np.full(len(control), -1)
    areas = net_areas(control)
    for first in range(len(control)):
        if flipped[first] >= 0:
            continue
        flipped[first], group = 0, [first]
        for one in group:  # grows as it is walked
            for other, turned in neighbours[one]:
                if flipped[other] < 0:
                    flipped[other] = flipped[one] ^ turned
                    group.append(other)
        mine = np.array(group)
        if areas[mine[flipped[mine] == 1]].sum() > areas[mine].sum() / 2:
            flipped[mine] ^= 1
    return np.where((flipped == 1)[:, None, None, None], control[:, :, ::-1], control)


def net_areas(control: Floats) -> Floats:
    """Areas (n,) of the quads between control points (n, 4, 4, 3), in their unit squared; 0 where one is not finite."""
    diagonals = control[:, 1:, 1:] - control[:, :-1, :-1], control[:, 1:, :-1] - control[:, :-1, 1:]
    return np.asarray(np.nan_to_num(np.linalg.norm(np.cross(*diagonals), axis=-1).sum(axis=(1, 2))) / 2)


def _edges(control: Floats) -> tuple[Indices, Flags]:
    """By edge, four for each patch: its number, -1 if it is a point, and whether it runs forwards (4 n,).

    Edges run around their patch. Those of the same control points have one number, in whichever direction they run.
    """
    around = np.stack([control[:, 0], control[:, :, 3], control[:, 3, ::-1], control[:, ::-1, 0]], axis=1).reshape(
        -1, 4, 3
    )
    finite = control[np.isfinite(control).all(axis=(1, 2, 3))].reshape(-1, 3)
    low = finite.min(axis=0, initial=np.inf)
    size = float((finite.max(axis=0, initial=-np.inf) - low).max()) if len(finite) else 1.0
    rounded = np.nan_to_num(np.round((around - low) / (COINCIDENT * (size or 1.0))), posinf=0.0, neginf=0.0)
    ahead, back = rounded.reshape(-1, 12), rounded[:, ::-1].reshape(-1, 12)
    differs = (ahead != back).argmax(axis=1)[:, None]
    forward = np.take_along_axis(ahead, differs, 1) <= np.take_along_axis(back, differs, 1)
    mixed = np.where(forward, ahead, back).astype(np.int64) @ _MIXING  # wraps around: a hash of 64 bits
    number = np.unique(mixed, return_inverse=True)[1]
    is_point = (np.ptp(rounded, axis=1) == 0).all(axis=1)
    return np.where(is_point, -1, number.reshape(-1)), forward.ravel()


def _used_twice(number: Indices) -> Indices:
    """(E, 2) pairs of edges with a number that no third edge has."""
    order = np.argsort(number, kind="stable")
    ranked = number[order]
    count = np.bincount(ranked[ranked >= 0], minlength=1)
    first = np.searchsorted(ranked, np.flatnonzero(count == 2))
    return np.stack([order[first], order[first + 1]], axis=1)
