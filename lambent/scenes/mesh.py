"""Triangle meshes, and functions on many meshes at once: for 100,000, a loop in Python would take minutes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.core.geometry.triangles import triangle_areas

Array = NDArray[np.floating]
TRIANGLES_AT_ONCE = 1 << 20


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh: positions (m), normals, tangents (V, 3) and uv (V, 2) float32; faces (T, 3) uint32.

    `tangents` are unit brushing directions t of the shading frame, perpendicular to the normals n (b = n x t).
    """

    positions: Array
    normals: Array
    tangents: Array
    uv: Array
    faces: NDArray[np.uint32]

    def at_vertices(self, source: NDArray[np.integer], faces: NDArray[np.uint32]) -> Mesh:
        """The mesh of `faces` (T, 3) over copies of the vertices `source` (W,)."""
        positions, normals, tangents, uv = (a[source] for a in (self.positions, self.normals, self.tangents, self.uv))
        return Mesh(positions, normals, tangents, uv, faces)

    @property
    def bounds(self) -> tuple[Array, Array]:
        return self.positions.min(axis=0), self.positions.max(axis=0)

    @property
    def corners(self) -> Array:
        """(T, 3, 3) float64 positions of the triangles' corners, m."""
        return self.corners_of(slice(None))

    def corners_of(self, faces: NDArray[np.integer] | slice) -> Array:
        """(K, 3, 3) float64 positions, m, of the corners of some triangles."""
        return np.asarray(self.positions[self.faces[faces]], float)


def boxes_of(meshes: Sequence[Mesh]) -> Array:
    """Bounding boxes (N, 2, 3) float32 of meshes: least and largest corner, m."""
    positions = np.concatenate([mesh.positions for mesh in meshes])
    first = np.cumsum([0] + [len(mesh.positions) for mesh in meshes[:-1]])
    return np.stack([np.minimum.reduceat(positions, first), np.maximum.reduceat(positions, first)], axis=1)


def corners_of(meshes: Sequence[Mesh]) -> Array:
    """(F, 3, 3) float64 positions, m, of the corners of all triangles, mesh after mesh."""
    return vertices_at_corners(meshes, [mesh.positions for mesh in meshes])


def vertices_at_corners(meshes: Sequence[Mesh], values: Sequence[Array]) -> Array:
    """(F, 3, ...) float64 values at the corners of all triangles, from the vertices' `values` (V, ...) of each mesh."""
    first = np.cumsum([0] + [len(own) for own in values[:-1]])
    faces = np.concatenate([mesh.faces for mesh in meshes]).astype(np.int64)
    faces += np.repeat(first, [len(mesh.faces) for mesh in meshes])[:, None]
    return np.asarray(np.concatenate(values)[faces], float)


def batches_of(meshes: Sequence[Mesh]) -> Iterator[slice]:
    """Slices of meshes with about TRIANGLES_AT_ONCE triangles each, which bounds the memory of array operations."""
    ends = np.cumsum([len(mesh.faces) for mesh in meshes])
    first = 0
    while first < len(meshes):
        before = ends[first - 1] if first else 0
        last = max(first + 1, int(np.searchsorted(ends, before + TRIANGLES_AT_ONCE, side="right")))
        yield slice(first, last)
        first = last


def areas_of_faces(meshes: Sequence[Mesh]) -> Array:
    """(F,) area of each triangle, m^2, mesh after mesh."""
    return np.concatenate([np.zeros(0), *(triangle_areas(corners_of(meshes[some])) for some in batches_of(meshes))])


def areas_of(meshes: Sequence[Mesh]) -> Array:
    """(N,) area of each mesh, m^2."""
    areas, ends = areas_of_faces(meshes), np.cumsum([len(mesh.faces) for mesh in meshes])
    return np.array([own.sum() for own in np.split(areas, ends[:-1])])
