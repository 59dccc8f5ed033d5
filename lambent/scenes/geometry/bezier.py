"""Bicubic Bezier patches: position, derivatives and normal.

Control points are (..., 4, 4, 3), those of a row along u, rows along v, as in files of patches. S(u, v) = sum over i, j
of B_i(v) B_j(u) P_ij with u and v from 0 to 1; the normal is along S_u x S_v. Control points broadcast with u and v.
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats

INWARDS = 1e-3  # share of the way to the middle of a patch where derivatives at a pole are taken instead
NO_NORMAL = 1e-7  # of |S_u x S_v|, relative to the squared size of a patch: below it, the limit from inside


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
