"""Triangles: normals, areas, random points, rays. Arrays of corners (..., 3, 3): triangle, corner, coordinate."""

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


def ray_distances(origin: Floats, direction: Floats, triangles: Floats) -> Floats:
    """Distances (T,), m, to triangles (T, 3, 3), on either side; inf for a miss (Moller & Trumbore 1997)."""
    edge1, edge2, s = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0], origin - triangles[:, 0]
    across = -np.cross(np.eye(3), direction)  # by which a vector becomes direction x vector
    p = edge2 @ across
    det = np.einsum("tc,tc->t", edge1, p)
    flat = np.abs(det) < 1e-20
    inverse = 1 / np.where(flat, 1, det)
    u, v = (np.einsum("tc,tc->t", *pair) * inverse for pair in ((s, p), (edge1, s @ across)))
    t = np.einsum("tc,tc->t", edge2, np.cross(s, edge1)) * inverse
    hit = ~flat & (u >= -1e-6) & (v >= -1e-6) & (u + v <= 1 + 1e-6) & (t > 1e-6)
    return np.where(hit, t, np.inf)
