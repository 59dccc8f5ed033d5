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
SLIVER_PX = 1.5  # width up to which a sliver may lie between the middles of pixels
LONG = 3.0  # length over width of a sliver
FEW_PX = 4.0  # side of a box whose triangles may be so small whatever their shape
Ranges = list[tuple[int, int]]
MERGED_GAP = 256  # faces between two runs that are drawn with them: another call costs as much


@dataclass(frozen=True)
class Seen:
    """Runs of faces, in order, none across the border of two objects: [begin, end)."""

    begin: Indices
    end: Indices

    def of(self, first_face: int, face_count: int) -> Ranges:
        """(first, count) of what the runs have of a range of faces."""
        last = first_face + face_count
        mine = slice(np.searchsorted(self.end, first_face, "right"), np.searchsorted(self.begin, last))
        begin, end = self.begin[mine].clip(first_face).tolist(), self.end[mine].clip(max=last).tolist()
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
        self._sliver_m = np.minimum.reduceat(_slivers(corners), at) if len(at) else np.zeros(0)
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
        return self._runs(self._visible(clip_from_world, rows))

    def _visible(self, clip_from_world: Floats, rows: tuple[float, float]) -> Flags:
        x, y, z, w = np.asarray(clip_from_world, np.float64)
        top, bottom = (1 - 2 * share for share in rows)
        visible = np.ones(len(self._begin), bool)
        for plane in (w + x, w - x, top * w - y, y - bottom * w, z, w - z):
            terms = np.where(plane[:3] > 0, self._high, self._low) * plane[:3]  # of the corner farthest inside
            reach = np.abs(terms).sum(axis=1) + abs(plane[3])
            # NaN and infinity: such a cluster is drawn.
            visible &= ~(terms.sum(axis=1) + plane[3] < -SLACK * reach)
        return visible

    def thin(self, clip_from_world: Floats, rows: tuple[float, float], height_px: int) -> Seen:
        """What of it may be too thin for the middles of pixels: slivers, and clusters of few pixels.

        `height_px` is that of the whole image; the rest as for `seen`.
        """
        _, y, _, w = np.asarray(clip_from_world, np.float64)
        centre, half = (self._high + self._low) / 2, (self._high - self._low) / 2
        away_m = centre @ w[:3] + w[3] + half @ np.abs(w[:3])
        with np.errstate(invalid="ignore"):
            narrow_m = np.maximum(away_m, 0) * 2 / (np.linalg.norm(y[:3]) * height_px)  # one pixel
            thin = ~(self._sliver_m > SLIVER_PX * narrow_m) | ~(2 * half.max(axis=1) > FEW_PX * narrow_m)
        return self._runs(self._visible(clip_from_world, rows) & thin)

    def _runs(self, visible: Flags) -> Seen:
        at = np.flatnonzero(visible)
        joined = (self._end[at[:-1]] == self._begin[at[1:]]) & (self._owner[at[:-1]] == self._owner[at[1:]])
        breaks = np.flatnonzero(~joined)
        first = at[np.concatenate([np.zeros(min(1, len(at)), np.int64), breaks + 1])]
        last = at[np.concatenate([breaks, np.full(min(1, len(at)), len(at) - 1)])]
        return Seen(self._begin[first], self._end[last])


def _slivers(corners: Floats) -> Floats:
    """(F,) least height (m) of triangles (F, 3, 3) that are long and thin, infinity for others."""
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    height = np.divide(area, edges, out=np.zeros_like(edges), where=edges > 0)
    return np.where((edges >= LONG * height) & (area > 0), height, np.inf)


def merged(runs: Iterable[tuple[int, int]], gap: int) -> Ranges:
    """(first, count) of runs [begin, end) in order, those together that are less than `gap` apart."""
    found: Ranges = []
    for begin, end in runs:
        if found and 0 <= begin - sum(found[-1]) < gap:
            found[-1] = (found[-1][0], end - found[-1][0])
        else:
            found.append((begin, end - begin))
    return found
