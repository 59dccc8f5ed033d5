"""Surfaces of meshes that were tessellated from Bezier patches: true areas, and exact places, normals and curvature.

The domain is that of the triangles, each with its piece of a patch's parameters: a mesh that has part of its patches
has points on that part alone. Triangles of no patch are the surface themselves. At a pole, where an edge of a patch is
one point, a triangle stands for the whole sector between its other corners.
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
COLLAPSED = 1e-9  # of a patch's size, that an edge which is one point may measure
# Places in a triangle and their weights: Gauss quadrature exact to degree 5 (Dunavant 1985), then near its corners.
NEAR, FAR, LOW, HIGH = 0.101286507323456, 0.797426985353087, 0.470142064105115, 0.059715871789770
PLACES = np.array([
    (1 / 3, 1 / 3, 1 / 3), (FAR, NEAR, NEAR), (NEAR, FAR, NEAR), (NEAR, NEAR, FAR), (HIGH, LOW, LOW), (LOW, HIGH, LOW),
    (LOW, LOW, HIGH), (0.98, 0.01, 0.01), (0.01, 0.98, 0.01), (0.01, 0.01, 0.98),
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
    if mesh.patches is not None:
        domain, faces = _Domain(mesh, mesh.patches), np.flatnonzero(mesh.patch_of_faces >= 0)
        for mine in slices(len(faces), AT_ONCE):
            areas[faces[mine]] = domain.elements_at_places(faces[mine]) @ WEIGHTS
    return areas


def even_in_area(mesh: Mesh, faces: Indices, weights: Floats, rng: np.random.Generator) -> Floats:
    """Barycentric weights (n, 3), even over the triangles `faces` (n,), made even over the surface by rejection."""
    on_patch = np.flatnonzero(mesh.patch_of_faces[faces] >= 0)
    if mesh.patches is None or not len(on_patch):
        return weights
    weights, domain = weights.copy(), _Domain(mesh, mesh.patches)
    most = np.zeros(len(mesh.faces))
    used = np.unique(faces[on_patch])
    for mine in slices(len(used), AT_ONCE):
        most[used[mine]] = MARGIN * domain.elements_at_places(used[mine]).max(axis=1)
    left = on_patch
    for _ in range(TURNS):
        element = domain.elements(faces[left], weights[left])
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
    uv, _ = _Domain(mesh, mesh.patches).parameters(faces[mine], weights[mine])
    place = mesh.patches.control[mesh.patch_of_faces[faces[mine]]], uv[:, 0], uv[:, 1]
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


class _Domain:
    """The parameters of the triangles of a mesh on its patches."""

    def __init__(self, mesh: Mesh, patches: Patches) -> None:
        self._mesh, self._patches = mesh, patches
        self._counts = _parameters_that_count(patches)

    def parameters(self, faces: Indices, weights: Floats) -> tuple[Floats, Floats]:
        """(..., 2) u and v at barycentric weights (..., 3) of triangles, and their area by that of the weights (...).

        Each is the mean over the corners where it counts: at a pole, one of both may be anything.
        """
        vertices = self._mesh.faces[faces]
        vertices = vertices.reshape(len(faces), *(1,) * (weights.ndim - 2), 3)
        counts, uv = self._counts[vertices], self._patches.uv[vertices]
        share = weights[..., None] * counts
        total = np.maximum(share.sum(axis=-2, keepdims=True), 1e-12)
        mean = (share * uv).sum(axis=-2, keepdims=True) / total
        slope = counts * (uv - mean) / total  # of u and v, by the weight of each corner
        area = cross_2d(slope[..., 1, :] - slope[..., 0, :], slope[..., 2, :] - slope[..., 0, :]) / 2
        return mean[..., 0, :], np.abs(area)

    def elements(self, faces: Indices, weights: Floats) -> Floats:
        """(...) area of the surface by that of barycentric weights (..., 3); the mean over a triangle is its area."""
        uv, area = self.parameters(faces, weights)
        number = self._patches.number[self._mesh.faces[faces, 0]]
        control = self._patches.control[number].reshape(len(faces), *(1,) * (weights.ndim - 2), 4, 4, 3)
        return np.asarray(area * bezier.area_elements(control, uv[..., 0], uv[..., 1]))

    def elements_at_places(self, faces: Indices) -> Floats:
        """(F, 10) `elements` at PLACES."""
        return self.elements(faces, np.broadcast_to(PLACES, (len(faces), *PLACES.shape)))


def _parameters_that_count(patches: Patches) -> Floats:
    """(V, 2) 0 for the parameter along an edge that is one point, where a vertex is on it; otherwise 1."""
    control, uv = patches.control, patches.uv
    counts = np.ones(uv.shape)
    if not len(control):
        return counts
    size = COLLAPSED * bezier.extents(control)
    for parameter, rows in ((0, control), (1, control.transpose(0, 2, 1, 3))):
        for end in (0, 1):
            is_point = np.ptp(rows[:, 3 * end], axis=1).max(axis=1) <= size
            on_it = (patches.number >= 0) & (uv[:, 1 - parameter] == end) & is_point[patches.number]
            counts[on_it, parameter] = 0
    return counts
