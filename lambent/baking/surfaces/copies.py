"""Copies: objects with the same mesh, translated, rotated and scaled uniformly. They share charts.

Files place a mesh by several nodes, but objects are meshes in world space. Copies are detected by their faces and by
the similarity that maps one object's vertices to another's (Umeyama 1991).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Flags, Floats, Indices
from lambent.scenes.scene import Mesh

TOLERANCE = 1e-3  # largest deviation of a copy, relative to the mean distance of vertices from their centre
KINDS = 32  # meshes with the same faces that are distinguished; later ones have no copies
NUMBERS_AT_ONCE = 1 << 22
STEP = 1.1  # ratio between successive texel sizes of copies


@dataclass(frozen=True)
class Copies:
    """By object: its original, or itself (N,), and its size relative to that (N,)."""

    first: Indices
    scale: Floats

    @property
    def shared(self) -> Flags:
        """(N,) whether each object is, or has, a copy."""
        return np.asarray(np.bincount(self.first, minlength=len(self.first))[self.first] > 1)

    def stepped(self, owner: Indices, sizes_m: Floats) -> Floats:
        """Texel sizes (K,) on parts of the objects `owner` (K,); those of copies are quantised, to share charts."""
        scale = self.scale[owner]
        steps = np.round(np.log(np.maximum(sizes_m / scale, 1e-30)) / np.log(STEP))
        return np.where(self.shared[owner], STEP**steps * scale, sizes_m)


def copies_of(meshes: Sequence[Mesh]) -> Copies:
    """Find meshes that are copies of others: vertices and faces in the same order, not mirrored."""
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
    """Flags of others (N,) that are the mesh moved, rotated and scaled uniformly, and their relative sizes (N,)."""
    at, size = _normalized(mesh.positions[None])
    found, larger = np.zeros(len(others), bool), np.ones(len(others))
    step = max(1, NUMBERS_AT_ONCE // at.size)
    for start in range(0, len(others), step):
        mine = slice(start, start + step)
        there, sizes = _normalized(np.stack([other.positions for other in others[mine]]))
        left, _, right = np.linalg.svd(np.einsum("vi,nvj->nij", at[0], there))
        left[:, :, 2] *= np.linalg.det(left @ right)[:, None]  # a rotation, not a reflection
        found[mine] = np.abs(at @ (left @ right) - there).max(axis=(1, 2)) < TOLERANCE
        larger[mine] = sizes / size
    return found & (larger > 0) & bool(size[0] > 0), larger


def _normalized(positions: Floats) -> tuple[Floats, Floats]:
    """Positions (N, V, 3) relative to their mean, with mean square 1, and their scales (N,)."""
    about = positions - positions.mean(axis=1, keepdims=True, dtype=float)
    size = np.sqrt((about**2).sum(axis=2).mean(axis=1))
    return about / np.maximum(size, 1e-30)[:, None, None], size
