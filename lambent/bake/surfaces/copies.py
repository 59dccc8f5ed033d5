"""Copies: objects of one mesh, moved, turned and scaled evenly. They share charts, which are found once.

A file places a mesh by many nodes, and objects are meshes in world space: copies are found by their faces and by the
similarity that takes one object's vertices to another's (Umeyama 1991).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Flags, Floats, Indices
from lambent.scenes.scene import Mesh

TOLERANCE = 1e-3  # of the mean distance of vertices from their middle: how far a copy's may be off
KINDS = 32  # of meshes with the same faces that are told apart; later ones have no copies
NUMBERS_AT_ONCE = 1 << 22
STEP = 1.1  # between the sizes of texels that copies may have


@dataclass(frozen=True)
class Copies:
    """By object: the first that it is a copy of, itself where it is the first (N,), and how much larger it is (N,)."""

    first: Indices
    scale: Floats

    @property
    def shared(self) -> Flags:
        """(N,) objects that are, or have, a copy."""
        return np.asarray(np.bincount(self.first, minlength=len(self.first))[self.first] > 1)

    def stepped(self, owner: Indices, sizes_m: Floats) -> Floats:
        """Sizes (K,) of texels on parts of the objects `owner` (K,); those of copies are in steps, to share charts."""
        scale = self.scale[owner]
        steps = np.round(np.log(np.maximum(sizes_m / scale, 1e-30)) / np.log(STEP))
        return np.where(self.shared[owner], STEP**steps * scale, sizes_m)


def copies_of(meshes: Sequence[Mesh]) -> Copies:
    """Which meshes are copies of others: vertices and faces in the same order, not mirrored."""
    first, scale = np.arange(len(meshes)), np.ones(len(meshes))
    alike: dict[tuple[int, bytes], list[int]] = {}
    for number, mesh in enumerate(meshes):
        alike.setdefault((len(mesh.positions), mesh.faces.tobytes()), []).append(number)
    for numbers in alike.values():
        left = np.array(numbers)
        for _ in range(KINDS):
            if len(left) < 2:
                break
            is_copy, larger = _similar(meshes[left[0]], [meshes[i] for i in left[1:]])
            mine = left[1:][is_copy]
            first[mine], scale[mine] = left[0], larger[is_copy]
            left = left[1:][~is_copy]
    return Copies(first, scale)


def _similar(mesh: Mesh, others: Sequence[Mesh]) -> tuple[Flags, Floats]:
    """Which others (N,) are the mesh moved, turned and scaled evenly, and how much larger they are (N,)."""
    at, size = _normalized(mesh.positions[None])
    found, larger = np.zeros(len(others), bool), np.ones(len(others))
    step = max(1, NUMBERS_AT_ONCE // at.size)
    for start in range(0, len(others), step):
        mine = slice(start, start + step)
        there, sizes = _normalized(np.stack([other.positions for other in others[mine]]))
        left, _, right = np.linalg.svd(np.einsum("vi,nvj->nij", at[0], there))
        left[:, :, 2] *= np.linalg.det(left @ right)[:, None]  # a turn, no mirror
        found[mine] = np.abs(at @ (left @ right) - there).max(axis=(1, 2)) < TOLERANCE
        larger[mine] = sizes / size
    return found & (larger > 0) & bool(size[0] > 0), larger


def _normalized(positions: Floats) -> tuple[Floats, Floats]:
    """Positions (N, V, 3) about their mean, one in the mean square, and what they were divided by (N,)."""
    about = positions - positions.mean(axis=1, keepdims=True, dtype=float)
    size = np.sqrt((about**2).sum(axis=2).mean(axis=1))
    return about / np.maximum(size, 1e-30)[:, None, None], size
