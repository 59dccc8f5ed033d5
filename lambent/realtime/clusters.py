"""Which triangles a camera can see: clusters of neighbours, by the boxes around them.

A software adapter spends a third of a small frame on vertices (docs/decisions.md), and a band of a frame would spend
as much again for each pass; what is outside of the view, or of the band, is left out here, on the CPU.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags, Floats, Indices
from lambent.store.contract import ObjectRecord

CLUSTER_FACES = 64
SLACK = 1e-5  # of the largest term of a plane's equation: the GPU counts in single precision
MERGED_GAP = 256  # faces between two runs that are drawn with them: another call costs as much


@dataclass(frozen=True)
class Seen:
    """Runs of faces, in order, none across the border of two objects: [begin, end)."""

    begin: Indices
    end: Indices

    def of(self, first_face: int, face_count: int) -> list[tuple[int, int]]:
        """(first, count) of the runs in a range of faces that begins and ends with objects."""
        low, high = np.searchsorted(self.begin, [first_face, first_face + face_count])
        begin, end = self.begin[low:high].tolist(), self.end[low:high].tolist()
        return merged(zip(begin, end, strict=True), MERGED_GAP)


class Clusters:
    """The clusters of a scene: `CLUSTER_FACES` neighbours of an object's index range each."""

    def __init__(self, positions: Floats, faces: NDArray[np.unsignedinteger], objects: Sequence[ObjectRecord]) -> None:
        """`positions` (V, 3), `faces` (F, 3)."""
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
        self._low, self._high = (
            reduce.reduceat(extreme, at, axis=0) if len(at) else np.zeros((0, 3))
            for reduce, extreme in ((np.minimum, corners.min(axis=1)), (np.maximum, corners.max(axis=1)))
        )

    def seen(self, clip_from_world: Floats, rows: tuple[float, float] = (0.0, 1.0)) -> Seen:
        """What a camera may see of the scene.

        Parameters
        ----------
        clip_from_world : (4, 4)
            Column vectors, WebGPU's clip space: |x|, |y| <= w, 0 <= z <= w.
        rows : (top, bottom)
            The band of the image that is drawn, as shares of its height.
        """
        x, y, z, w = np.asarray(clip_from_world, np.float64)
        top, bottom = (1 - 2 * share for share in rows)
        visible = np.ones(len(self._begin), bool)
        for plane in (w + x, w - x, top * w - y, y - bottom * w, z, w - z):
            terms = np.where(plane[:3] > 0, self._high, self._low) * plane[:3]  # of the corner farthest inside
            reach = np.abs(terms).sum(axis=1) + abs(plane[3])
            # NaN and infinity: such a cluster is drawn.
            visible &= ~(terms.sum(axis=1) + plane[3] < -SLACK * reach)
        return self._runs(visible)

    def _runs(self, visible: Flags) -> Seen:
        at = np.flatnonzero(visible)
        joined = (self._end[at[:-1]] == self._begin[at[1:]]) & (self._owner[at[:-1]] == self._owner[at[1:]])
        breaks = np.flatnonzero(~joined)
        first = at[np.concatenate([np.zeros(min(1, len(at)), np.int64), breaks + 1])]
        last = at[np.concatenate([breaks, np.full(min(1, len(at)), len(at) - 1)])]
        return Seen(self._begin[first], self._end[last])


def merged(runs: Iterable[tuple[int, int]], gap: int) -> list[tuple[int, int]]:
    """(first, count) of runs [begin, end) in order, those together that are less than `gap` apart."""
    found: list[tuple[int, int]] = []
    for begin, end in runs:
        if found and 0 <= begin - sum(found[-1]) < gap:
            found[-1] = (found[-1][0], end - found[-1][0])
        else:
            found.append((begin, end - begin))
    return found
