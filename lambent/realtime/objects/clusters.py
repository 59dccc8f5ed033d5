"""Frustum culling on the CPU, by bounding boxes of clusters of neighbouring triangles.

A software adapter spends a third of a small frame on vertices.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags, Floats
from lambent.store.contract import ObjectRecord

ANYWHERE_M = 1e9
CLUSTER_FACES = 64
SLACK = 1e-5  # of the largest term of a plane's equation: the GPU computes in single precision
SLIVER_PX = 1.5  # slivers up to this width may miss all pixel centres
LONG = 3.0  # length over width of a sliver
FEW_PX = 4.0  # triangles in boxes of up to this side may miss all pixel centres, whatever their shape
Ranges = list[tuple[int, int]]
MERGED_GAP = 256  # faces; runs with a smaller gap are drawn in one call, which costs less than a second call


@dataclass(frozen=True)
class Seen:
    """Runs of faces, in order, none across the border of two objects: [begin, end).

    `thin`: of these a camera draws only the faces that may miss all pixel centres (`RenderPass.draw_thin`).
    """

    begin: list[int]
    end: list[int]
    thin: bool = False

    def of(self, first_face: int, face_count: int) -> Ranges:
        """(first, count) of each run within a range of faces."""
        last = first_face + face_count
        mine = range(bisect_right(self.end, first_face), bisect_left(self.begin, last))
        return merged(((max(self.begin[k], first_face), min(self.end[k], last)) for k in mine), MERGED_GAP)


class Clusters:
    """The clusters of a scene, each of `CLUSTER_FACES` consecutive faces of one object."""

    def __init__(self, positions: Floats, faces: NDArray[np.unsignedinteger], objects: Sequence[ObjectRecord]) -> None:
        """Vertices are at `positions` (V, 3), metres; `faces` (F, 3) are their indices."""
        ordered = sorted(objects, key=lambda record: record.first_face)
        limits = [(o.first_face, o.first_face + o.face_count) for o in ordered]
        starts = [np.arange(first, end, CLUSTER_FACES) for first, end in limits]
        ends = [np.minimum(s + CLUSTER_FACES, end) for s, (_, end) in zip(starts, limits, strict=True)]
        self._owner = np.repeat(np.arange(len(ordered)), [len(s) for s in starts])
        none = np.zeros(0, np.int64)
        self._begin, self._end = (np.concatenate([none, *parts]) for parts in (starts, ends))
        # A record may leave faces out between two objects.
        owned = np.concatenate([none, *(np.arange(first, end) for first, end in limits)])
        corners, at = np.asarray(positions, np.float64)[faces[owned]], np.searchsorted(owned, self._begin)
        self._sliver_m = np.minimum.reduceat(_slivers(corners), at) if len(at) else np.zeros(0)
        low, high = (
            reduce.reduceat(extreme, at, axis=0) if len(at) else np.zeros((0, 3))
            for reduce, extreme in ((np.minimum, corners.min(axis=1)), (np.maximum, corners.max(axis=1)))
        )
        with np.errstate(invalid="ignore"):
            self._centre, self._half = (high + low) / 2, (high - low) / 2
        moves = np.array([o.luminaire is not None for o in ordered], bool)  # with its lamp: it is never culled
        self._half[moves[self._owner]] = ANYWHERE_M
        self._largest = np.maximum(np.abs(low), np.abs(high))

    def table(self) -> tuple[NDArray[np.uint32], NDArray[np.float32]]:
        """What `seen` and `thin` know of each cluster.

        (K, 3): first face, the one after the last, number of the object; (K, 10), metres: middle, half of the size,
        largest coordinates, narrowest sliver.
        """
        places = np.column_stack([self._begin, self._end, self._owner]).astype(np.uint32)
        return places, np.column_stack([self._centre, self._half, self._largest, self._sliver_m]).astype(np.float32)

    def with_any(self, faces: Flags) -> Flags:
        """The clusters that hold any of the faces (F,)."""
        before = np.concatenate([[0], np.cumsum(faces)])
        return np.asarray(before[self._end] > before[self._begin])

    def seen(self, clip_from_world: Floats, among: Flags | bool = True) -> Seen:
        """The clusters that a camera may see.

        Parameters
        ----------
        clip_from_world : (4, 4)
            Column vectors, WebGPU's clip space: |x|, |y| <= w, 0 <= z <= w.
        among
            The clusters that count, by default all.
        """
        return self._runs(self._visible(clip_from_world) & among)

    def whole(self, among: Flags | bool = True) -> Seen:
        """All clusters of those `among`, for a frame that any camera may look at."""
        return self._runs(np.ones(len(self._begin), bool) & among)

    def _visible(self, clip_from_world: Floats) -> Flags:
        x, y, z, w = np.asarray(clip_from_world, np.float64)
        planes = np.array([w + x, w - x, w - y, y + w, z, w - z]).T
        normals = planes[:3]
        farthest = self._centre @ normals + self._half @ np.abs(normals) + planes[3]  # of the corner farthest inside
        reach = self._largest @ np.abs(normals) + np.abs(planes[3])
        # Clusters with NaN or infinite terms are drawn.
        return np.asarray(~(farthest < -SLACK * reach).any(axis=1))

    def thin(self, clip_from_world: Floats, height_px: int) -> Seen:
        """The faces in view that may miss all pixel centres: slivers, and clusters of few pixels.

        `height_px` is the height of the image; `clip_from_world` as in `seen`.
        """
        _, y, _, w = np.asarray(clip_from_world, np.float64)
        away_m = self._centre @ w[:3] + w[3] + self._half @ np.abs(w[:3])
        with np.errstate(invalid="ignore"):
            narrow_m = np.maximum(away_m, 0) * 2 / (np.linalg.norm(y[:3]) * height_px)  # one pixel
            thin = ~(self._sliver_m > SLIVER_PX * narrow_m) | ~(2 * self._half.max(axis=1) > FEW_PX * narrow_m)
        return self._runs(self._visible(clip_from_world) & thin)

    def _runs(self, visible: Flags) -> Seen:
        at = np.flatnonzero(visible)
        joined = (self._end[at[:-1]] == self._begin[at[1:]]) & (self._owner[at[:-1]] == self._owner[at[1:]])
        breaks = np.flatnonzero(~joined)
        first = at[np.concatenate([np.zeros(min(1, len(at)), np.int64), breaks + 1])]
        last = at[np.concatenate([breaks, np.full(min(1, len(at)), len(at) - 1)])]
        return Seen(self._begin[first].tolist(), self._end[last].tolist())


def _slivers(corners: Floats) -> Floats:
    """(F,) least height, m, of long and thin triangles among (F, 3, 3), infinity for others."""
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    height = np.divide(area, edges, out=np.zeros_like(edges), where=edges > 0)
    return np.where((edges >= LONG * height) & (area > 0), height, np.inf)


def merged(runs: Iterable[tuple[int, int]], gap: int) -> Ranges:
    """(first, count) of ordered runs [begin, end), merged where less than `gap` apart."""
    found: Ranges = []
    for begin, end in runs:
        if found and 0 <= begin - sum(found[-1]) < gap:
            found[-1] = (found[-1][0], end - found[-1][0])
        else:
            found.append((begin, end - begin))
    return found
