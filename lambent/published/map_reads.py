"""Misses of caches of a light field's maps as thesis R counts them, and those of the optimal cache.

The thesis keeps faces of cube maps, which it reads on demand from the first row to that of the texel (section 4.3; rows
are consecutive in compressed TIFF files), and counts each texel of bilinear look-ups (tables 6.3 to 6.6). The optimal
cache knows all reads (Belady 1966).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from heapq import heappop, heappush
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baked.light_fields.light_field import NO_POINT
from lambent.baked.light_fields.lookup import Place
from lambent.baked.light_fields.map_cache import POLICIES, MapCache, misses
from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import on_face

NEVER = 1 << 62
FACE_TEXELS = 128  # along a face of the thesis's cube maps


class KnownFuture:
    """Evicts the map that is read again last: the optimal policy, which knows all `reads` in order."""

    def __init__(self, reads: Sequence[int], capacity: int) -> None:
        self.capacity = capacity
        self._following, seen = [NEVER] * len(reads), dict[int, int]()
        for at in range(len(reads) - 1, -1, -1):
            self._following[at] = seen.get(reads[at], NEVER)
            seen[reads[at]] = at
        self._at, self._maps, self._queue = 0, dict[int, int](), list[tuple[int, int]]()

    def read(self, name: int, keep: Collection[int] = ()) -> bool:
        there = name in self._maps
        while not there and len(self._maps) >= self.capacity:
            when, last = heappop(self._queue)
            if self._maps.get(last) == -when:
                del self._maps[last]
        self._maps[name] = self._following[self._at]
        heappush(self._queue, (-self._maps[name], name))
        self._at += 1
        return there

    @property
    def held(self) -> Collection[int]:
        return self._maps.keys()


def fewest_misses(reads: Sequence[int], capacity: int) -> int:
    """Misses of the optimal policy."""
    return misses(reads, KnownFuture(reads, capacity))


def thesis_reads(
    place: Place, w: Floats, orders: dict[str, NDArray[np.int64]], capacities: tuple[int, ...]
) -> Iterator[dict[str, Any]]:
    """Misses of reflections by the thesis's count, at places with mirror directions w (k, 3), by order of pixels."""
    for order, pixels in orders.items():
        face, row = _face_rows(np.repeat(w[pixels, None], place.points.shape[1], axis=1))
        known = place.points[pixels] != NO_POINT
        item = (6 * place.points[pixels] + face)[known].repeat(4).tolist()
        rows = (row[known][:, None] + [0, 0, 1, 1]).ravel().tolist()
        reads = list(zip(item, rows, strict=True))
        for capacity in capacities:
            kept = {name: make(capacity) for name, make in POLICIES.items()}
            kept["known future"] = KnownFuture(item, capacity)
            missed = {name: round(100 * partial_misses(reads, of) / len(reads), 4) for name, of in kept.items()}
            said = {"reads": "reflection, texels of faces", "order": order, "maps": capacity}
            yield {**said, "count": len(reads), "first": len(set(item)), "miss_percent": missed}


def partial_misses(reads: list[tuple[int, int]], cache: MapCache) -> int:
    """Reads (item, row) that find their item missing from `cache`, or read only to an earlier row."""
    ends, missed = dict[int, int](), 0
    for item, row in reads:
        end = ends.get(item, -1) if cache.read(item) else -1
        missed += row > end
        ends[item] = max(end, row)
    return missed


def _face_rows(w: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Face and row (...) of the first of the 2 x 2 texels that `cubemap.sample` reads along w (..., 3)."""
    face, _, t = on_face(w)
    row = np.floor(((t + 1) / 2 * FACE_TEXELS - 0.5).clip(0, FACE_TEXELS - 2))
    return face.astype(np.int64), row.astype(np.int64)
