"""Sums of paths by bands and tails, sparse: most of what a point could have, it has not (Ben-Artzi 2007, eq. 6.1).

Threads take points. Each adds up a point's samples in one dense row, which stays in the cache, and keeps what is not 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

TOGETHER = 16  # points that use one dense row, one after another


@dataclass(frozen=True)
class Sorted:
    """Samples of points, sorted into the bands of a term: sample s of point p has the number p * samples + s.

    Attributes
    ----------
    value : (3, n) float32
        Factor of the light that arrives.
    band : (n,) uint32
    light : (3, entries, n) float32
    tail : (entries, n) uint32
        Without the second surface's bands.
    factor : (terms, 2, 3, n) float32
        Of the second surface's terms, for the light that was sampled there and for where the path went on. Without
        second surfaces that count by bands, there are no terms.
    second : (terms, 2, n) uint32
        Their bands.
    widths : (entries,) int64
        Tails of each of these bands.
    """

    value: NDArray[np.float32]
    band: NDArray[np.uint32]
    light: NDArray[np.float32]
    tail: NDArray[np.uint32]
    factor: NDArray[np.float32]
    second: NDArray[np.uint32]
    widths: NDArray[np.int64]


@dataclass(frozen=True)
class Sums:
    """Sums over samples: of each point, entries ends[p] to ends[p + 1], by rising code.

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
        """These sums and those of more samples."""
        points = len(self.ends) - 1
        each = len(samples.band) // points * len(samples.tail) * max(1, len(samples.factor))
        room = self.ends + each * np.arange(points + 1)
        codes, light = np.empty(room[-1], np.uint32), np.empty((room[-1], 3), np.float32)
        counts = _add(
            codes, light, room, self.ends, self.codes, self.light, samples.value, samples.band, samples.light,
            samples.tail, samples.factor, samples.second, samples.widths, bands, bands * tails,
        )  # fmt: skip
        ends = np.concatenate([[0], np.cumsum(counts)])
        return Sums(ends, *_closed_up(codes, light, room, ends))


@numba.njit(parallel=True, cache=True, nogil=True)
def _add(  # type: ignore[no-untyped-def]
    codes, sums, room, ends, old_codes, old_sums, value, band, light, tail, factor, second, widths, bands, size
):
    points = len(ends) - 1
    samples, entries, terms = len(band) // points, len(tail), len(factor)
    counts = np.zeros(points, np.int64)
    for block in numba.prange((points + TOGETHER - 1) // TOGETHER):
        row = np.zeros((size, 3), np.float32)
        met = np.zeros(size, np.bool_)
        for p in range(block * TOGETHER, min(points, (block + 1) * TOGETHER)):
            here, n = codes[room[p] : room[p + 1]], 0
            for k in range(ends[p], ends[p + 1]):
                code = old_codes[k]
                met[code], here[n], n = True, code, n + 1
                for c in range(3):
                    row[code, c] = old_sums[k, c]
            for i in range(p * samples, (p + 1) * samples):
                if value[0, i] + value[1, i] + value[2, i] <= 0:
                    continue
                for e in range(entries):
                    if light[0, e, i] + light[1, e, i] + light[2, e, i] <= 0:
                        continue
                    for t in range(max(terms, 1)):
                        code = tail[e, i]
                        r, g, b = (
                            value[0, i] * light[0, e, i],
                            value[1, i] * light[1, e, i],
                            value[2, i] * light[2, e, i],
                        )
                        if terms > 0:
                            way = min(e, 1)
                            r, g, b = (
                                r * factor[t, way, 0, i], g * factor[t, way, 1, i], b * factor[t, way, 2, i]
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


@numba.njit(parallel=True, cache=True, nogil=True)
def _closed_up(codes, light, room, ends):  # type: ignore[no-untyped-def]
    """Entries without the room between points."""
    out, sums = np.empty(ends[-1], np.uint32), np.empty((ends[-1], 3), np.float32)
    for p in numba.prange(len(ends) - 1):
        for k in range(ends[p + 1] - ends[p]):
            out[ends[p] + k] = codes[room[p] + k]
            for c in range(3):
                sums[ends[p] + k, c] = light[room[p] + k, c]
    return out, sums
