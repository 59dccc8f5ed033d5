"""Vertices in fewer bytes: normals and tangents as points of an octahedron, of 16 bits a side; all else is exact.

The page computes the same floats from them to the bit: with additions, products, quotients and square roots alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

STEPS = 32767  # from the centre of the octahedron's square to an edge: directions change by 4e-5 rad at most
UNITS = (3, 6)  # first floats of the normal and the tangent
LENGTH_ERROR = 1e-6  # of unit vectors, as single precision leaves them


def words_of(vertices: NDArray[np.float32]) -> NDArray[np.uint32] | None:
    """Words (N, 11) of vertices (N, 13); None where a normal or tangent has another length than 1."""
    parts, done = [], 0
    for first in UNITS:
        vectors = vertices[:, first : first + 3].astype(np.float64)
        if (np.abs((vectors**2).sum(axis=1) - 1) > 2 * LENGTH_ERROR).any():
            return None
        parts += [vertices[:, done:first].view(np.uint32), _in_square(vectors).view(np.uint32)]
        done = first + 3
    return np.concatenate([*parts, vertices[:, done:].view(np.uint32)], axis=1)


def vertices_of(words: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Vertices (N, 13) of their words (N, 11)."""
    parts, done = [], 0
    for shorter, first in enumerate(UNITS):
        at = first - shorter
        parts += [words[:, done:at].view(np.float32), _from_square(words[:, at : at + 2].view(np.int32))]
        done = at + 2
    return np.concatenate([*parts, words[:, done:].view(np.float32)], axis=1)


def _in_square(vectors: NDArray[np.float64]) -> NDArray[np.int32]:
    """Points (N, 2) in steps; the lower half is folded over the edges, as in `core.geometry.octahedral`."""
    x, y, z = (vectors / np.abs(vectors).sum(axis=1, keepdims=True)).T
    lower = z < 0
    folded = np.stack([np.where(lower, _folded(x, y), x), np.where(lower, _folded(y, x), y)], axis=1)
    return np.round(STEPS * folded).astype(np.int32)


def _from_square(points: NDArray[np.int32]) -> NDArray[np.float32]:
    x, y = (points / STEPS).T
    z = 1 - np.abs(x) - np.abs(y)
    lower = z < 0
    x, y = np.where(lower, _folded(x, y), x), np.where(lower, _folded(y, x), y)
    length = np.sqrt(x * x + y * y + z * z)
    return np.stack([x / length, y / length, z / length], axis=1).astype(np.float32)


def _folded(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return (1 - np.abs(b)) * np.where(a >= 0, 1.0, -1.0)
