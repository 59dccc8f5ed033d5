"""Sparse sums of paths by bands and tails: most of a point's possible entries are 0 (Ben-Artzi 2007, eq. 6.1).

Threads work on points. Each sums a point's samples in one dense row, which stays in the cache, and keeps the nonzero
entries.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

TOGETHER = 16  # points that share a dense row in turn; fewer if that would leave fewer than SHARES pieces of work
SHARES = 64


@dataclass(frozen=True)
class Sorted:
    """Samples of points, sorted into the bands of a term: sample s of point p has the index p * samples + s.

    Each row of four has a colour, and the bits of a number.

    Attributes
    ----------
    first : (n, 4) float32
        Factor on the arriving light, and the band.
    light : (entries, n, 4) float32
        Arriving light, and its tail without the second surface's bands.
    arrived : (n,) uint32
        Bit e is set if entry e has light.
    second : (terms, 2, n, 4) float32
        Factor and band of the second surface's terms, for the light sampled there and for the path's continuation.
        There are no terms if second surfaces do not contribute by bands.
    widths : (entries,) int64
        Number of tails per band.
    """

    first: NDArray[np.float32]
    light: NDArray[np.float32]
    arrived: NDArray[np.uint32]
    second: NDArray[np.float32]
    widths: NDArray[np.int64]


@dataclass(frozen=True)
class Sums:
    """Sums over samples: point p has entries ends[p] to ends[p + 1], by ascending code.

    Attributes
    ----------
    ends : (P + 1,) int64
    codes : (N,) uint32
        Tail times the number of bands, plus band.
    light : (N, 3) float32
    """

    ends: NDArray[np.int64]
    codes: NDArray[np.uint32]
    light: NDArray[np.float32]

    @classmethod
    def none(cls, points: int) -> Sums:
        return cls(np.zeros(points + 1, np.int64), np.zeros(0, np.uint32), np.zeros((0, 3), np.float32))

    def and_of(self, samples: Sorted, bands: int, tails: int) -> Sums:
        """Add the sums of more samples."""
        points = len(self.ends) - 1
        each = len(samples.first) // points * len(samples.light) * max(1, len(samples.second))
        room = np.concatenate([[0], np.cumsum(np.minimum(np.diff(self.ends) + each, bands * tails))])
        codes, light = np.empty(room[-1], np.uint32), np.empty((room[-1], 3), np.float32)
        counts = _add(
            codes, light, room, self.ends, self.codes, self.light, samples.first, _bits(samples.first), samples.light,
            _bits(samples.light), samples.arrived, samples.second, _bits(samples.second), samples.widths, bands,
            bands * tails, max(1, min(TOGETHER, points // SHARES)),
        )  # fmt: skip
        ends = np.concatenate([[0], np.cumsum(counts)])
        return Sums(ends, *_closed_up(codes, light, room, ends))


def _bits(rows: NDArray[np.float32]) -> NDArray[np.uint32]:
    return rows.view(np.uint32)[..., 3]


def compile_sums(by_second: bool) -> None:
    """Compile everything that `Sums.and_of` calls for arrays of paths; takes seconds if numba's cache is empty."""
    rows = [np.zeros((*shape, 4), np.float32) for shape in ((2,), (2, 2), (int(by_second), 2, 2))]
    first, light, second = rows
    nothing = Sorted(first, light, np.zeros(2, np.uint32), second, np.ones(2, np.int64))
    Sums.none(1).and_of(nothing, bands=1, tails=1)


@numba.njit(cache=True, nogil=True)
def _add(  # type: ignore[no-untyped-def]
    codes, sums, room, ends, old_codes, old_sums, first, band, light, tail, arrived, factor, second, widths, bands,
    size, together,
):  # fmt: skip
    points = len(ends) - 1
    samples, entries, terms = len(band) // points, len(tail), len(factor)
    counts = np.zeros(points, np.int64)
    for block in range((points + together - 1) // together):
        row = np.zeros((size, 3), np.float32)
        met = np.zeros(size, np.bool_)
        for p in range(block * together, min(points, (block + 1) * together)):
            here, n = codes[room[p] : room[p + 1]], 0
            for k in range(ends[p], ends[p + 1]):
                code = old_codes[k]
                met[code], here[n], n = True, code, n + 1
                for c in range(3):
                    row[code, c] = old_sums[k, c]
            for i in range(p * samples, (p + 1) * samples):
                if first[i, 0] + first[i, 1] + first[i, 2] <= 0:
                    continue
                for e in range(entries):
                    if not arrived[i] >> e & 1:
                        continue
                    for t in range(max(terms, 1)):
                        code = tail[e, i]
                        r, g, b = (
                            first[i, 0] * light[e, i, 0],
                            first[i, 1] * light[e, i, 1],
                            first[i, 2] * light[e, i, 2],
                        )
                        if terms > 0:
                            way = min(e, 1)
                            r, g, b = (
                                r * factor[t, way, i, 0], g * factor[t, way, i, 1], b * factor[t, way, i, 2]
                            )  # fmt: skip
                            if not r + g + b > 0:
                                continue
                            code += second[t, way, i] * widths[e]
                        code = code * bands + band[i]
                        if not met[code]:
                            met[code], here[n], n = True, code, n + 1
                        row[code, 0] += r
                        row[code, 1] += g
                        row[code, 2] += b
            here[:n].sort()
            for k in range(n):
                code = here[k]
                for c in range(3):
                    sums[room[p] + k, c] = row[code, c]
                    row[code, c] = 0
                met[code] = False
            counts[p] = n
    return counts


@numba.njit(cache=True, nogil=True)
def _closed_up(codes, light, room, ends):  # type: ignore[no-untyped-def]
    """Entries without gaps between points."""
    out, sums = np.empty(ends[-1], np.uint32), np.empty((ends[-1], 3), np.float32)
    for p in range(len(ends) - 1):
        for k in range(ends[p + 1] - ends[p]):
            out[ends[p] + k] = codes[room[p] + k]
            for c in range(3):
                sums[ends[p] + k, c] = light[room[p] + k, c]
    return out, sums
