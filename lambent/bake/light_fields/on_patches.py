"""Surfaces of meshes that were tessellated from Bezier patches: true areas, and exact places, normals and curvature.

The domain is that of the triangles, each with its piece of a patch's parameters: a mesh that has part of its patches
has points on that part alone. Triangles of no patch are the surface themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.bake.tiles import slices
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry import cross_2d, triangle_areas, triangle_normals
from lambent.scenes.geometry import bezier
from lambent.scenes.mesh import Mesh, Patches

AT_ONCE = 1 << 15  # triangles
MARGIN = 1.1  # of the area element at the places below, that it exceeds nowhere in a triangle
TURNS = 32  # draws of a place within a triangle, of which one in two or more is kept
LEANING = 0.2  # cosine between patch and triangle below which a triangle stands for itself: a fold, or a cusp
# Places in a triangle and their weights: Gauss quadrature exact to degree 5 (Dunavant 1985), then its corners.
NEAR, FAR, LOW, HIGH = 0.101286507323456, 0.797426985353087, 0.470142064105115, 0.059715871789770
PLACES = np.array([
    (1 / 3, 1 / 3, 1 / 3), (FAR, NEAR, NEAR), (NEAR, FAR, NEAR), (NEAR, NEAR, FAR), (HIGH, LOW, LOW), (LOW, HIGH, LOW),
    (LOW, LOW, HIGH), (1, 0, 0), (0, 1, 0), (0, 0, 1),
])  # fmt: skip
WEIGHTS = np.array([0.225, *(0.125939180544827,) * 3, *(0.132394152788506,) * 3, 0, 0, 0])


@dataclass(frozen=True)
class ExactPlaces:
    """Which of n places (n,) are on patches; of those (k,) point, unit normal, and turning of the normal, 1/m."""

    found: Flags
    positions: Floats
    normals: Floats
    turning: Floats


def surface_areas(mesh: Mesh) -> Floats:
    """(F,) areas of the surface that triangles stand for, m^2."""
    areas = triangle_areas(mesh.corners)
    if mesh.patches is None:
        return areas
    for some in _curved(mesh):
        share = np.abs(_parameter_areas(mesh.patches, mesh, some))
        areas[some] = share * (_elements(mesh.patches, mesh, some) @ WEIGHTS)
    return areas


def even_in_area(mesh: Mesh, faces: Indices, weights: Floats, rng: np.random.Generator) -> Floats:
    """Barycentric weights (n, 3), even over the triangles `faces` (n,), made even over the surface by rejection."""
    on_patch = np.flatnonzero(mesh.patch_of_faces[faces] >= 0)
    if mesh.patches is None or not len(on_patch):
        return weights
    weights = weights.copy()
    most = np.zeros(len(mesh.faces))
    used = np.unique(faces[on_patch])
    for mine in slices(len(used), AT_ONCE):
        most[used[mine]] = MARGIN * _elements(mesh.patches, mesh, used[mine]).max(axis=1)
    left = on_patch
    for _ in range(TURNS):
        number, uv = _places(mesh.patches, mesh, faces[left], weights[left])
        element = bezier.area_elements(mesh.patches.control[number], uv[:, 0], uv[:, 1])
        left = left[rng.random(len(left)) * most[faces[left]] > element]
        if not len(left):
            break
        weights[left] = rng.dirichlet((1, 1, 1), size=len(left))
    return weights


def exact_places(mesh: Mesh, faces: Indices, weights: Floats) -> ExactPlaces:
    """Where places of triangles are on their patches, with normals on the triangles' outside.

    Points lie on the patch, or on the triangle where this is farther out: rays see triangles, and points must not be
    behind them.
    """
    found = mesh.patch_of_faces[faces] >= 0
    if mesh.patches is None or not found.any():
        return ExactPlaces(np.zeros(len(faces), bool), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
    mine = np.flatnonzero(found)
    corners = mesh.corners_of(faces[mine])
    flat = triangle_normals(corners)
    number, uv = _places(mesh.patches, mesh, faces[mine], weights[mine])
    place = mesh.patches.control[number], uv[:, 0], uv[:, 1]
    positions, normals = bezier.positions(*place), bezier.normals(*place)
    cosine = (normals * flat).sum(axis=1)
    normals *= np.sign(cosine)[:, None]
    on_triangle = np.einsum("kc,kcx->kx", weights[mine], corners)
    away = on_triangle - positions
    over = (away * flat).sum(axis=1) / np.maximum(np.abs(cosine), LEANING)
    size = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max(axis=1)
    sound = (np.abs(cosine) > LEANING) & (np.linalg.norm(away, axis=1) < size)
    found[mine[~sound]] = False
    outer = positions + np.maximum(over, 0.0)[:, None] * normals
    return ExactPlaces(found, outer[sound], normals[sound], bezier.turning(*place)[sound])


def _curved(mesh: Mesh) -> list[Indices]:
    """Triangles on patches, AT_ONCE at a time."""
    faces = np.flatnonzero(mesh.patch_of_faces >= 0)
    return [faces[mine] for mine in slices(len(faces), AT_ONCE)]


def _elements(patches: Patches, mesh: Mesh, faces: Indices) -> Floats:
    """(F, 10) area elements at PLACES of triangles."""
    vertices = mesh.faces[faces]
    uv = np.einsum("kc,fcx->fkx", PLACES, patches.uv[vertices])
    control = patches.control[patches.number[vertices[:, 0]], None]
    return bezier.area_elements(control, uv[..., 0], uv[..., 1])


def _parameter_areas(patches: Patches, mesh: Mesh, faces: Indices) -> Floats:
    """(F,) signed areas of triangles in the parameters of their patches."""
    a, b, c = np.moveaxis(patches.uv[mesh.faces[faces]], 1, 0)
    return np.asarray(cross_2d(b - a, c - a) / 2)


def _places(patches: Patches, mesh: Mesh, faces: Indices, weights: Floats) -> tuple[Indices, Floats]:
    """Patch (n,) and parameters (n, 2) of places on triangles."""
    vertices = mesh.faces[faces]
    uv = np.einsum("nc,ncx->nx", weights, patches.uv[vertices])
    return patches.number[vertices[:, 0]].astype(np.int64), np.asarray(uv)
