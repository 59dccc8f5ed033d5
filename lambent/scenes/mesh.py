"""Triangle meshes, and what is found of many at once: of 100,000, one by one, it would take minutes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.core.geometry import triangle_areas

Array = NDArray[np.floating]
TRIANGLES_AT_ONCE = 1 << 20


@dataclass(frozen=True)
class Mesh:
    """Triangles. positions, normals (V, 3) float32; uv (V, 2) float32; tangents (V, 3) float32; faces (T, 3) uint32.

    `tangents` is the brushing direction t of the shading frame, unit, at right angles to the normal (b = n x t).
    """

    positions: Array
    normals: Array
    tangents: Array
    uv: Array
    faces: NDArray[np.uint32]

    @property
    def bounds(self) -> tuple[Array, Array]:
        return self.positions.min(axis=0), self.positions.max(axis=0)

    @property
    def corners(self) -> Array:
        """(T, 3, 3) float64 positions of the triangles' corners."""
        return self.corners_of(slice(None))

    def corners_of(self, faces: NDArray[np.integer] | slice) -> Array:
        """(K, 3, 3) float64 positions of the corners of some triangles."""
        return np.asarray(self.positions[self.faces[faces]], float)


def boxes_of(meshes: Sequence[Mesh]) -> Array:
    """(N, 2, 3) float32 least and largest corner of the box around each mesh, all of them at once."""
    positions = np.concatenate([mesh.positions for mesh in meshes])
    first = np.cumsum([0] + [len(mesh.positions) for mesh in meshes[:-1]])
    return np.stack([np.minimum.reduceat(positions, first), np.maximum.reduceat(positions, first)], axis=1)


def corners_of(meshes: Sequence[Mesh]) -> Array:
    """(F, 3, 3) float64 positions of the corners of all triangles, mesh after mesh, all of them at once."""
    return vertices_at_corners(meshes, [mesh.positions for mesh in meshes])


def vertices_at_corners(meshes: Sequence[Mesh], values: Sequence[Array]) -> Array:
    """(F, 3, ...) float64 values at the corners of all triangles; `values` are those of each mesh's vertices."""
    first = np.cumsum([0] + [len(own) for own in values[:-1]])
    faces = np.concatenate([mesh.faces for mesh in meshes]).astype(np.int64)
    faces += np.repeat(first, [len(mesh.faces) for mesh in meshes])[:, None]
    return np.asarray(np.concatenate(values)[faces], float)


def batches_of(meshes: Sequence[Mesh]) -> Iterator[slice]:
    """Meshes in batches of about TRIANGLES_AT_ONCE triangles: what is found of all at once then takes little memory."""
    ends = np.cumsum([len(mesh.faces) for mesh in meshes])
    first = 0
    while first < len(meshes):
        before = ends[first - 1] if first else 0
        last = max(first + 1, int(np.searchsorted(ends, before + TRIANGLES_AT_ONCE, side="right")))
        yield slice(first, last)
        first = last


def areas_of_faces(meshes: Sequence[Mesh]) -> Array:
    """(F,) areas of all triangles in m^2, mesh after mesh."""
    return np.concatenate([np.zeros(0), *(triangle_areas(corners_of(meshes[some])) for some in batches_of(meshes))])


def areas_of(meshes: Sequence[Mesh]) -> Array:
    """(N,) area of each mesh in m^2."""
    areas, ends = areas_of_faces(meshes), np.cumsum([len(mesh.faces) for mesh in meshes])
    return np.array([own.sum() for own in np.split(areas, ends[:-1])])
