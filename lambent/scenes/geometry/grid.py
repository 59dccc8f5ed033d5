"""Meshes from sheets of points in rows and columns, and operations on meshes."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lambent.core.geometry.directions import Floats, basis, normalize
from lambent.core.geometry.triangles import area_vectors, triangle_areas
from lambent.scenes.mesh import Mesh

FLAT = 1e-10  # triangles below this share of their sheet's extent squared count as degenerate
VERTICES_AT_ONCE = 1 << 18


def tangents_along(normals: Floats, direction: ArrayLike) -> Floats:
    """Unit tangents (V, 3) along `direction`, (3,) or (V, 3), projected into the surface; any where it is normal."""
    along = np.broadcast_to(np.asarray(direction, float), normals.shape)
    flat = along - normals * np.sum(normals * along, axis=-1, keepdims=True)
    usable = np.linalg.norm(flat, axis=-1, keepdims=True) > 1e-4
    tangents = normalize(np.where(usable, flat, basis(normals)[0]))
    return normalize(tangents - normals * np.sum(normals * tangents, axis=-1, keepdims=True))


def build(positions: Floats, normals: Floats, direction: ArrayLike, uv: Floats, faces: NDArray[np.integer]) -> Mesh:
    """Mesh of (V, ...) arrays and triangles in any winding; `direction` as in `tangents_along`.

    Triangles without area and unused vertices are dropped, the winding follows the normals.
    """
    positions = np.asarray(positions, np.float32)
    normals = normalize(np.asarray(normals, float))
    extent = float(np.ptp(positions, axis=0).max())
    faces = faces[triangle_areas(positions[faces].astype(float)) > FLAT * extent**2]
    outward = np.sum(area_vectors(positions[faces].astype(float)) * normals[faces].sum(axis=1), axis=-1)
    faces = np.where((outward < 0)[:, None], faces[:, ::-1], faces)
    used, index = np.unique(faces, return_inverse=True)
    tangents = tangents_along(normals, direction)
    return Mesh(
        positions[used],
        normals[used].astype(np.float32),
        tangents[used].astype(np.float32),
        np.asarray(uv, np.float32)[used],
        index.reshape(-1, 3).astype(np.uint32),
    )


def grid(positions: Floats, normals: Floats, direction: ArrayLike, uv: Floats) -> Mesh:
    """Mesh of a sheet: positions and normals (R, C, 3), uv (R, C, 2), `direction` (3,) or (R, C, 3)."""
    rows, columns = positions.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    along = np.asarray(direction, float)
    along = along.reshape(-1, 3) if along.ndim == 3 else along
    return build(positions.reshape(-1, 3), normals.reshape(-1, 3), along, uv.reshape(-1, 2), faces)


def merge(meshes: Iterable[Mesh]) -> Mesh:
    """One mesh of several."""
    parts = list(meshes)
    starts = np.cumsum([0] + [len(m.positions) for m in parts[:-1]]).astype(np.uint32)
    names = ("positions", "normals", "tangents", "uv")
    positions, normals, tangents, uv = (np.concatenate([getattr(m, name) for m in parts]) for name in names)
    faces = np.concatenate([m.faces + start for m, start in zip(parts, starts, strict=True)])
    return Mesh(positions, normals, tangents, uv, faces)


def transformed(mesh: Mesh, matrix: ArrayLike) -> Mesh:
    """`mesh` under an affine 4x4 matrix; a mirroring one reverses the winding, so that outside stays outside."""
    return copies_under(mesh, np.asarray(matrix, float)[None])[0]


def copies_under(mesh: Mesh, matrices: Floats) -> list[Mesh]:
    """`mesh` as `transformed` by each of the matrices (N, 4, 4). Copies that are only moved share all but positions."""
    _, first, which = np.unique(
        matrices[:, :3, :3].reshape(-1, 9), axis=0, return_index=True, return_inverse=True
    )  # fmt: skip
    which, turned = which.reshape(-1), []
    for mine in _some(len(first), len(mesh.positions)):
        linear = matrices[first[mine], :3, :3]
        normals = normalize(mesh.normals.astype(float) @ np.linalg.inv(linear))
        tangents = tangents_along(normals, mesh.tangents @ linear.transpose(0, 2, 1)).astype(np.float32)
        turned += list(zip(normals.astype(np.float32), tangents, np.linalg.det(linear) < 0, strict=True))
    mirrored = mesh.faces[:, ::-1].copy() if any(flips for _, _, flips in turned) else mesh.faces
    copies = []
    for mine in _some(len(matrices), len(mesh.positions)):
        linear, moved = matrices[mine, :3, :3].transpose(0, 2, 1), matrices[mine, None, :3, 3]
        moved_positions = (mesh.positions @ linear + moved).astype(np.float32)
        for positions, number in zip(moved_positions, which[mine], strict=True):
            normals, tangents, flips = turned[number]
            copies.append(Mesh(positions, normals, tangents, mesh.uv, mirrored if flips else mesh.faces))
    return copies


def _some(count: int, vertices: int) -> Iterable[slice]:
    """Copies of a mesh of so many vertices, as many at a time as VERTICES_AT_ONCE allows."""
    step = max(1, VERTICES_AT_ONCE // max(vertices, 1))
    return (slice(first, first + step) for first in range(0, count, step))


def turn(axis: str, angle_deg: float) -> Floats:
    """3x3 right-handed rotation about "x", "y" or "z", exact in the components along the axis."""
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix = np.eye(3)
    matrix[i, i], matrix[i, j], matrix[j, i], matrix[j, j] = c, -s, s, c
    return matrix


def placed(mesh: Mesh, at: ArrayLike = (0.0, 0.0, 0.0), rotation: Floats | None = None) -> Mesh:
    """`mesh` rotated about the origin by a 3x3 matrix, then moved to `at` (metres)."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.eye(3) if rotation is None else rotation
    matrix[:3, 3] = at
    return transformed(mesh, matrix)


def signed_volume(mesh: Mesh) -> float:
    """Volume in m^3 of a closed mesh, negative where it is inside out."""
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    return float(np.sum(a * np.cross(b, c)) / 6)


def subdivided(mesh: Mesh, longest_m: float, most: int) -> Mesh:
    """The same surface, with triangles divided into four until no edge exceeds `longest_m`, or to `most` triangles."""
    while 4 * len(mesh.faces) <= most and _longest_m(mesh) > longest_m:
        mesh = _in_four(mesh)
    return mesh


def _longest_m(mesh: Mesh) -> float:
    corners = mesh.corners
    return float(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(initial=0))


def _in_four(mesh: Mesh) -> Mesh:
    """Divide triangles at the midpoints of their edges; a shared edge has one new vertex."""
    faces = mesh.faces.astype(np.int64)
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1), axis=-1)
    pairs, middle = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    a, b, c = faces.T
    ab, bc, ca = (middle.reshape(-1, 3) + len(mesh.positions)).T
    parts = np.concatenate([np.stack(t, axis=-1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])

    def halved(values: np.ndarray, unit: bool) -> np.ndarray:
        mean = values[pairs].mean(axis=1)
        return np.concatenate([values, normalize(mean) if unit else mean]).astype(np.float32)

    return Mesh(
        halved(mesh.positions, False), halved(mesh.normals, True), halved(mesh.tangents, True), halved(mesh.uv, False),
        parts.astype(np.uint32),
    )  # fmt: skip
