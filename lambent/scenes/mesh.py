"""Triangle meshes, and functions on many meshes at once: for 100,000, a loop in Python would take minutes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lambent.core.geometry import triangle_areas

Array = NDArray[np.floating]
TRIANGLES_AT_ONCE = 1 << 20


NO_PATCH = -1


@dataclass(frozen=True)
class Patches:
    """The bicubic Bezier patches that a mesh was tessellated from (`scenes.geometry.bezier`).

    `control` (n, 4, 4, 3) are control points in world space, m. By vertex, `number` (V,) int32 is its patch or
    NO_PATCH, and `uv` (V, 2) its parameters there. S_u x S_v may point inwards: outside is where the mesh's normals
    point.
    """

    control: Array
    number: NDArray[np.int32]
    uv: Array

    def at_vertices(self, source: NDArray[np.integer]) -> Patches:
        """For a mesh whose vertices are copies of the vertices `source` (W,)."""
        return replace(self, number=self.number[source], uv=self.uv[source])

    def transformed(self, matrix: Array) -> Patches:
        """The patches under an affine 4x4 matrix."""
        return replace(self, control=self.control @ matrix[:3, :3].T + matrix[:3, 3])

    def with_vertices_between(self, pairs: NDArray[np.integer], share: Array) -> Patches:
        """With a vertex more on each edge (E, 2), at shares (E, 1) of its way: of no patch between two patches."""
        numbers, ends = self.number[pairs], self.uv[pairs].astype(float)
        number = np.where(numbers[:, 0] == numbers[:, 1], numbers[:, 0], NO_PATCH).astype(np.int32)
        uv = (1 - share) * ends[:, 0] + share * ends[:, 1]
        return replace(self, number=np.append(self.number, number), uv=np.concatenate([self.uv, uv]))


def merged_patches(meshes: Sequence[Mesh]) -> Patches | None:
    """The patches of meshes whose vertices are joined into one mesh, numbered mesh after mesh; None without any."""
    if all(mesh.patches is None for mesh in meshes):
        return None
    parts = [mesh.patches or no_patches(len(mesh.positions)) for mesh in meshes]
    first = np.cumsum([0] + [len(part.control) for part in parts[:-1]])
    numbers = [np.where(part.number < 0, NO_PATCH, part.number + n) for part, n in zip(parts, first, strict=True)]
    return Patches(
        np.concatenate([part.control for part in parts]),
        np.concatenate(numbers).astype(np.int32),
        np.concatenate([part.uv for part in parts]),
    )


def no_patches(vertices: int) -> Patches:
    """Vertices of no patch."""
    return Patches(np.zeros((0, 4, 4, 3)), np.full(vertices, NO_PATCH, np.int32), np.zeros((vertices, 2)))


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh: positions (m), normals, tangents (V, 3) and uv (V, 2) float32; faces (T, 3) uint32.

    `tangents` are unit brushing directions t of the shading frame, perpendicular to the normals n (b = n x t).
    `patches` are the curved surface that it approximates, where that is known.
    """

    positions: Array
    normals: Array
    tangents: Array
    uv: Array
    faces: NDArray[np.uint32]
    patches: Patches | None = None

    @property
    def patch_of_faces(self) -> NDArray[np.int32]:
        """(T,) the patch that all corners of a triangle lie on, or NO_PATCH."""
        if self.patches is None:
            return np.full(len(self.faces), NO_PATCH, np.int32)
        numbers = self.patches.number[self.faces]
        return np.where((numbers == numbers[:, :1]).all(axis=1), numbers[:, 0], NO_PATCH)

    def at_vertices(self, source: NDArray[np.integer], faces: NDArray[np.uint32]) -> Mesh:
        """The mesh of `faces` (T, 3) over copies of the vertices `source` (W,)."""
        patches = None if self.patches is None else self.patches.at_vertices(source)
        positions, normals, tangents, uv = (a[source] for a in (self.positions, self.normals, self.tangents, self.uv))
        return Mesh(positions, normals, tangents, uv, faces, patches)

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
