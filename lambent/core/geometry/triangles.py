"""Triangles: normals, areas, random points. Arrays of corners (..., 3, 3): triangle, corner, coordinate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize


def area_vectors(corners: Floats) -> Floats:
    """Normals (..., 3) of counter-clockwise triangles (..., 3, 3), scaled to twice the area."""
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    return np.asarray(np.cross(b - a, c - a))


def triangle_areas(corners: Floats) -> Floats:
    """Areas (...) of triangles (..., 3, 3)."""
    return np.asarray(np.linalg.norm(area_vectors(corners), axis=-1) / 2)


def triangle_normals(corners: Floats) -> Floats:
    """Unit normals (..., 3) of triangles (..., 3, 3); 0 for degenerate ones."""
    return normalize(area_vectors(corners))


def corner_angles(corners: Floats) -> Floats:
    """Angles (..., 3) in radians at the corners of triangles (..., 3, 3)."""
    after, before = (normalize(np.roll(corners, -k, axis=-2) - corners) for k in (1, 2))
    return np.asarray(np.arccos(np.clip((after * before).sum(axis=-1), -1, 1)))


def points_on_triangles(corners: Floats, face: NDArray[np.integer], rng: np.random.Generator) -> Floats:
    """One point (K, 3) on each of the triangles `face` (K,), uniform by area; corners (F, 3, 3) of all triangles."""
    weights = rng.dirichlet((1, 1, 1), size=len(face))
    return np.asarray(np.einsum("kcx,kc->kx", corners[face], weights))


def cross_2d(u: Floats, v: Floats) -> Floats:
    """Cross product (...) of plane vectors (..., 2): positive where v lies counter-clockwise of u."""
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])
