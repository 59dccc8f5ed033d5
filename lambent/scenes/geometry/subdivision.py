"""Meshes of smaller triangles."""

from __future__ import annotations

import numpy as np

from lambent.core.geometry.directions import normalize
from lambent.scenes.scene import Mesh


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
