"""Which triangles a camera can see: clusters of neighbours, by the boxes around them.

An adapter in software spends a third of a small frame on vertices (docs/window.md), and a band of a frame would spend
as much again for each pass; what is outside of the view, or of the band, is left out here, on the CPU.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.store.contract import ObjectRecord

Floats = NDArray[np.floating]
Ints = NDArray[np.int64]
CLUSTER_FACES = 64
SLACK = 1e-5  # of the largest term of a plane's equation: the GPU counts in single precision
MERGED_GAP = 256  # faces between two runs that are drawn with them: another call costs as much


@dataclass(frozen=True)
class Seen:
    """Runs of faces, in order, none across the border of two objects: [begin, end)."""

    begin: Ints
    end: Ints

    def of(self, first_face: int, face_count: int) -> list[tuple[int, int]]:
        """(first, count) of the runs in a range of faces that begins and ends with objects."""
        low, high = np.searchsorted(self.begin, [first_face, first_face + face_count])
        begin, end = self.begin[low:high].tolist(), self.end[low:high].tolist()
        runs: list[tuple[int, int]] = []
        for a, b in zip(begin, end, strict=True):
            if runs and a - sum(runs[-1]) < MERGED_GAP:
                runs[-1] = (runs[-1][0], b - runs[-1][0])
            else:
                runs.append((a, b - a))
        return runs


class Clusters:
    """The clusters of a scene: `CLUSTER_FACES` neighbours of an object's index range each."""

    def __init__(self, positions: Floats, faces: NDArray[np.unsignedinteger], objects: Sequence[ObjectRecord]) -> None:
        """`positions` (V, 3), `faces` (F, 3)."""
        starts = [np.arange(o.first_face, o.first_face + o.face_count, CLUSTER_FACES) for o in objects]
        ends = [
            np.minimum(s + CLUSTER_FACES, o.first_face + o.face_count) for s, o in zip(starts, objects, strict=True)
        ]
        self._owner = np.repeat(np.arange(len(objects)), [len(s) for s in starts])
        self._begin, self._end = (np.concatenate([np.zeros(0, np.int64), *parts]) for parts in (starts, ends))
        order = np.argsort(self._begin, kind="stable")
        self._begin, self._end, self._owner = self._begin[order], self._end[order], self._owner[order]
        corners = np.asarray(positions, np.float64)[faces]
        low, high = corners.min(axis=1), corners.max(axis=1)  # of the faces
        # Clusters lie one behind the other, but a record may leave faces out between two objects.
        self._low = _reduced(np.minimum, low, self._begin, self._end)
        self._high = _reduced(np.maximum, high, self._begin, self._end)

    def seen(self, clip_from_world: Floats, rows: tuple[float, float] = (0.0, 1.0)) -> Seen:
        """What a camera may see of the scene.

        Parameters
        ----------
        clip_from_world : (4, 4)
            Column vectors, WebGPU's clip space: |x|, |y| <= w, 0 <= z <= w.
        rows : (top, bottom)
            The band of the picture that is wanted, as shares of its height.
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

    def _runs(self, visible: NDArray[np.bool_]) -> Seen:
        at = np.flatnonzero(visible)
        joined = (self._end[at[:-1]] == self._begin[at[1:]]) & (self._owner[at[:-1]] == self._owner[at[1:]])
        breaks = np.flatnonzero(~joined)
        first = at[np.concatenate([np.zeros(min(1, len(at)), np.int64), breaks + 1])]
        last = at[np.concatenate([breaks, np.full(min(1, len(at)), len(at) - 1)])]
        return Seen(self._begin[first], self._end[last])


def _reduced(how: np.ufunc, values: Floats, begin: Ints, end: Ints) -> Floats:
    """`how` over values[begin:end] for each cluster; every cluster has a face."""
    if not len(begin):
        return np.zeros((0, 3))
    limits = np.minimum(np.column_stack([begin, end]).ravel(), len(values) - 1)  # reduceat takes no end
    found = how.reduceat(values, limits, axis=0)[::2]
    final = end == len(values)  # there the last face was left to nobody
    return how(found, np.where(final[:, None], values[-1], found))
