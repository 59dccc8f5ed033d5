"""Per-band incremental pictures, for edits that change everything, such as rotating the environment.

Each level of the wavelets is a separate incremental picture. Every frame gives each level a share of the terms, and
either adds its changes or redraws it from its largest coefficients, whichever leaves the smaller error (Overbeck et al.
2006, "Exploiting temporal coherence for incremental all-frequency relighting").
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.editing.incremental import TERMS, IncrementalPicture
from lambent.editing.products import Halves, HostProducts, Pixels
from lambent.editing.sparse_rows import SparseRows


class PerBandPicture:
    """An incremental picture by levels; `transport` as in `IncrementalPicture`.

    Parameters
    ----------
    transport
        (J, C, P) float16 by wavelets, coarse to fine; or sparse rows.
    levels
        (J,) level of each, in ascending order (`core.wavelets.levels`).
    """

    def __init__(self, transport: Halves | SparseRows, levels: NDArray[np.integer]) -> None:
        starts = np.flatnonzero(np.diff(levels, prepend=-1))
        self._ranges = [slice(a, b) for a, b in zip(starts, [*starts[1:], len(levels)], strict=True)]
        self._levels = [IncrementalPicture(HostProducts(transport[part])) for part in self._ranges]

    @property
    def is_exact(self) -> bool:
        return all(level.is_exact for level in self._levels)

    @property
    def picture(self) -> Pixels:
        """(C, P) float32."""
        return np.asarray(np.sum([level.picture for level in self._levels], axis=0), np.float32)

    @property
    def effective(self) -> Floats:
        """(J, C) coefficients that the picture shows."""
        return np.concatenate([level.effective for level in self._levels])

    def want(self, coefficients: Floats) -> None:
        """Set the coefficients (J, C) for the picture to show."""
        for level, part in zip(self._levels, self._ranges, strict=True):
            level.want(coefficients[part])

    def step(self, terms: int = TERMS) -> None:
        """One frame of `terms` terms, or fewer if they make the picture exact."""
        for level, (share, anew) in zip(self._levels, self._shares(terms), strict=True):
            if anew:
                level.clear()
            level.step(share)

    def draw(self) -> None:
        """Draw the exact picture at once, from every coefficient."""
        for level in self._levels:
            level.draw()

    def _shares(self, terms: int) -> list[tuple[int, bool]]:
        """(terms, whether to redraw) for each level: the largest drops of squared error per term come first."""
        changed = [_errors_left(level.wanted - level.effective) for level in self._levels]
        anew = [_errors_left(level.wanted) for level in self._levels]
        best = [np.minimum(a, b) for a, b in zip(changed, anew, strict=True)]
        drops = [(gain, i, begin, end) for i, errors in enumerate(best) for gain, begin, end in _hull(errors)]
        shares, left = [0] * len(best), terms
        for gain, i, begin, end in sorted(drops, key=lambda drop: -drop[0]):
            if gain <= 0 or left == 0 or begin != shares[i]:
                continue
            shares[i] += min(end - begin, left)
            left = max(0, left - (end - begin))
        return [(k, bool(anew[i][k] < changed[i][k])) for i, k in enumerate(shares)]


def _errors_left(coefficients: Floats) -> Floats:
    """(J + 1,) squared error after drawing the 0, 1, ... J largest of the coefficients (J, C)."""
    energy = np.sort(np.sum(coefficients * coefficients, axis=1))
    return np.concatenate([[0.0], np.cumsum(energy)])[::-1]


def _hull(errors: Floats) -> list[tuple[float, int, int]]:
    """Segments (drop per term, begin, end) of the lower convex hull of errors over terms."""
    corners = [0]
    for k in range(1, len(errors)):
        corners.append(k)
        while len(corners) > 2:
            a, b, c = corners[-3:]
            if (errors[b] - errors[a]) * (c - a) < (errors[c] - errors[a]) * (b - a):
                break
            del corners[-2]
    return [(float((errors[a] - errors[b]) / (b - a)), a, b) for a, b in itertools.pairwise(corners)]
