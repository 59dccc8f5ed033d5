"""Cutting of very large triangles, to separate the part near viewers, which then can have finer texels.

A ground plane of two triangles, for example, is halved along longest edges (Rivara 1984), until no triangle near
viewers is longer than their view reaches, and no distant one longer than its distance. Neighbours are cut as well, to
avoid T-junctions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry.directions import normalize
from lambent.scenes.mesh import Mesh, boxes_of

LEAST_M = 10.0  # shorter triangles are never cut
TIMES = 4.0  # multiple of the viewers' reach from which on an object's triangles are cut
MOST_FACES = 20_000  # per object, after which nothing more is cut
ROUNDS = 64
ON_PLANE = 1e-6  # metres, and share of the largest coordinate: closer vertices count as on a plane


def lengths_of(corners: Floats) -> Floats:
    """(F,) longest edge of triangles (F, 3, 3)."""
    return np.asarray(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1, initial=0))


def too_long(meshes: Sequence[Mesh], reach_m: float = 0.0) -> Indices:
    """Indices of the meshes with triangles long enough to be cut for viewers who see `reach_m` far."""
    longest = max(LEAST_M, TIMES * reach_m)
    boxes = boxes_of(meshes).astype(float)
    large = np.flatnonzero(np.linalg.norm(boxes[:, 1] - boxes[:, 0], axis=1) > longest)
    lengths = (lengths_of(meshes[int(number)].corners).max(initial=0) for number in large)
    return large[np.fromiter(lengths, float, len(large)) > longest]


def cut(mesh: Mesh, eyes: Floats, reach_m: float) -> Mesh:
    """The mesh with no triangle longer than the larger of `reach_m` and its distance from the nearest eye (E, 3)."""
    for _ in range(ROUNDS):
        corners = mesh.corners.astype(float)
        middles = corners.mean(axis=1)
        length, radius = lengths_of(corners), np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
        large = np.flatnonzero(length > max(reach_m, LEAST_M / TIMES))
        away = np.linalg.norm(middles[large, None] - eyes, axis=2).min(axis=1) - radius[large]
        wanted = np.zeros(len(corners), bool)
        wanted[large] = length[large] > away
        if not wanted.any() or len(corners) > MOST_FACES:
            break
        mesh = _halved(mesh, wanted)
    return mesh


def _halved(mesh: Mesh, wanted: Flags) -> Mesh:
    """Halve triangles `wanted` (F,) across their longest edge, and others as needed to avoid T-junctions."""
    _, place = np.unique(mesh.positions, axis=0, return_inverse=True)
    place = place.reshape(-1).astype(np.int64)

    def edges(faces: Indices) -> Indices:
        """(F, 3) edge numbers opposite to corners 2, 0, 1, independent of how vertices are split."""
        ends = np.sort(np.stack([place[faces], place[np.roll(faces, -1, axis=1)]], axis=-1), axis=-1)
        return np.asarray((ends[..., 0] << 32) + ends[..., 1])

    faces = mesh.faces.astype(np.int64)
    corners = mesh.corners.astype(float)
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).argmax(axis=1)
    number, rows = edges(faces), np.arange(len(faces))
    marked = np.unique(number[wanted, longest[wanted]])
    while True:
        touched = np.isin(number, marked).any(axis=1)
        more = np.unique(number[touched, longest[touched]])
        if np.isin(more, marked).all():
            break
        marked = np.union1d(marked, more)
    faces = np.take_along_axis(faces, (longest[:, None] + np.arange(3)) % 3, axis=1)[rows]  # longest edge first
    for _ in range(2):  # first the longest edge, then the rest of the others
        hit = np.isin(edges(faces), marked)
        first = hit.argmax(axis=1)
        faces = np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, axis=1)
        a, b, c = faces[hit.any(axis=1)].T
        mesh, middle = _with_vertices(mesh, a, b)
        place = np.concatenate([place, place.max() + 1 + np.arange(len(mesh.positions) - len(place))])
        halves = [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
        faces = np.concatenate([faces[~hit.any(axis=1)], *halves])
    return replace(mesh, faces=faces.astype(np.uint32))


def cut_across(mesh: Mesh, plane: tuple[float, float, float, float]) -> Mesh:
    """The mesh with new vertices where a plane (n, d), n.x + d = 0, crosses its edges: no triangle lies on both sides.

    Triangles on both sides of an edge get the same vertex if they share its vertices, or their vertices coincide.
    """
    n, d = np.array(plane[:3], float), plane[3]
    height = (mesh.positions.astype(float) @ n + d) / np.linalg.norm(n)
    height[np.abs(height) < ON_PLANE * (1 + np.abs(mesh.positions).max(axis=1))] = 0
    faces = mesh.faces.astype(np.int64)
    for _ in range(2):  # first one of the crossing edges, then the other
        ends = height[faces] * height[np.roll(faces, -1, axis=1)]
        crossed = (ends < 0).any(axis=1)
        if not crossed.any():
            break
        first = (ends < 0).argmax(axis=1)[crossed]
        a, b, c = np.take_along_axis(faces[crossed], (first[:, None] + np.arange(3)) % 3, axis=1).T
        mesh, between = _with_vertices(mesh, a, b, height)
        height = np.append(height, np.zeros(len(mesh.positions) - len(height)))
        halves = [np.stack([a, between, c], axis=1), np.stack([between, b, c], axis=1)]
        faces = np.concatenate([faces[~crossed], *halves])
    return replace(mesh, faces=faces.astype(np.uint32))


def _with_vertices(mesh: Mesh, a: Indices, b: Indices, height: Floats | None = None) -> tuple[Mesh, Indices]:
    """The mesh with new vertices between vertices a and b (N,), one per distinct pair, and their numbers (N,).

    They are at the midpoint, or where `height` (V,), of opposite signs at both ends, is 0.
    """
    pairs, index = np.unique(np.sort(np.stack([a, b], axis=1), axis=1), axis=0, return_inverse=True)
    ends = np.ones((len(pairs), 2)) * (1, -1) if height is None else height[pairs]
    low, high = ends[:, :1], ends[:, 1:]

    def between(values: Floats) -> Floats:
        """Bitwise equal from both ends."""
        start, end = values.astype(float)[pairs.T]
        return np.asarray((start * high - end * low) / (high - low))

    def longer(old: Floats, new: Floats) -> Floats:
        return np.concatenate([old, new]).astype(old.dtype)

    longer_mesh = Mesh(
        longer(mesh.positions, between(mesh.positions)),
        longer(mesh.normals, normalize(between(mesh.normals))),
        longer(mesh.tangents, normalize(between(mesh.tangents))),
        longer(mesh.uv, between(mesh.uv)),
        mesh.faces,
    )
    return longer_mesh, len(mesh.positions) + index.reshape(-1)
