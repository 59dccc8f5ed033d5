"""Cube maps: the direction of each texel, the same for the bake, the shaders and the benches.

Faces in the order +x, -x, +y, -y, +z, -z, rows from the top, exactly as WebGPU samples a cube texture: an array of
shape (6, N, N, C) uploaded layer by layer is read back by `textureSample(cube, s, direction)` with world directions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats


def face_directions(n: int) -> Floats:
    """(6, n, n, 3) directions of the texel centres, scaled so that the largest component is 1 (not unit vectors)."""
    c = (np.arange(n) + 0.5) / n * 2 - 1
    return _on_all_faces(*np.meshgrid(c, c))


def directions_at(face: NDArray[np.integer], s: Floats, t: Floats) -> Floats:
    """Directions (..., 3) (largest component 1) at face coordinates s, t in [-1, 1], t downwards."""
    return np.stack([np.choose(face, choices) for choices in zip(*faces_at(s, t), strict=True)], axis=-1)


def faces_at(s: Any, t: Any) -> list[tuple[Any, Any, Any]]:
    """x, y, z (the largest 1) by face, at face coordinates s, t in [-1, 1], t downwards; arrays of any library."""
    return [(1.0, -t, -s), (-1.0, -t, s), (s, 1.0, t), (s, -1.0, -t), (s, -t, 1.0), (-s, -t, -1.0)]


def _on_all_faces(s: Floats, t: Floats) -> Floats:
    """(6, ..., 3) directions at s, t (...) of every face."""
    return np.stack([np.stack(np.broadcast_arrays(*face), axis=-1) for face in faces_at(s, t)])


def texel_solid_angles(n: int) -> Floats:
    """(n, n) exact solid angles of one face's texels in sr; the six faces sum to 4 pi."""
    edge = np.linspace(-1, 1, n + 1)
    s, t = np.meshgrid(edge, edge)
    corner = np.arctan2(s * t, np.sqrt(s * s + t * t + 1))
    return np.asarray(corner[1:, 1:] - corner[:-1, 1:] - corner[1:, :-1] + corner[:-1, :-1])


def sample(cube: Floats, w: Floats) -> Floats:
    """Bilinear look-up, clamped within each face: (..., C) of cube (6, n, n, C) at directions w (..., 3)."""
    n = cube.shape[1]
    face, s, t = on_face(w)
    column, row = ((np.stack([s, t]) + 1) / 2 * n - 0.5).clip(0, n - 1)
    c0, r0 = np.floor(column).astype(int), np.floor(row).astype(int)
    c1, r1 = np.minimum(c0 + 1, n - 1), np.minimum(r0 + 1, n - 1)
    fc, fr = (column - c0)[..., None], (row - r0)[..., None]
    top = cube[face, r0, c0] * (1 - fc) + cube[face, r0, c1] * fc
    bottom = cube[face, r1, c0] * (1 - fc) + cube[face, r1, c1] * fc
    return np.asarray(top * (1 - fr) + bottom * fr)


def on_face(w: Floats) -> tuple[NDArray[np.int64], Floats, Floats]:
    """Face (...) and face coordinates s, t (...) of directions w (..., 3)."""
    x, y, z = w[..., 0], w[..., 1], w[..., 2]
    axis = np.argmax(np.abs(w), axis=-1)
    major = np.take_along_axis(w, axis[..., None], axis=-1)[..., 0]
    face = axis * 2 + (major < 0)
    s = np.choose(face, [-z, z, x, x, x, -x]) / np.abs(major)
    t = np.choose(face, [-y, -y, z, -z, -y, -y]) / np.abs(major)
    return face, s, t
