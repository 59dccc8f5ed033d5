"""Array types, numbers of a text, hashes of points, and sums, ranges and components of things with numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating]
Flags = NDArray[np.bool_]
Indices = NDArray[np.int64]
Image = NDArray[np.float32]  # linear Rec.709, (H, W, 3)
MIXERS = np.array([0x1E3779B97F4A7C15, 0x42B2AE3D27D4EB4F, 0x165667B19E3779F9])  # odd, without a pattern


def numbers_in(text: bytes, kind: type = float) -> NDArray[Any] | None:
    """The numbers (n,) of a text, between blanks and line ends; None if a word is not one.

    `np.fromstring` alone takes "- 1" for one number, and "1.2.3" for two.
    """
    blank = np.frombuffer(text, np.uint8) <= ord(" ")
    count = int(np.count_nonzero(blank[:-1] & ~blank[1:])) + int(np.count_nonzero(~blank[:1]))
    try:
        values: NDArray[Any] = np.fromstring(text, kind, sep=" ") if count else np.zeros(0, kind)
    except ValueError:
        return None
    return values if len(values) == count else None


def hashes(points: Floats) -> Indices:
    """(n,) hashes of points (n, 2) or (n, 3) in float32; those of different points hardly ever agree."""
    bits = np.asarray(points + 0.0, np.float32).view(np.int32).astype(np.int64)  # -0 is 0
    mixed = bits @ MIXERS[: bits.shape[1]]
    return np.asarray((mixed ^ (mixed >> 29)) * MIXERS[0])


def sums_of(values: Floats, of: NDArray[np.integer], count: int) -> Floats:
    """(count, C) sums of values (n, C) over those that belong to each number, `of` (n,)."""
    return np.stack([np.bincount(of, column, minlength=count) for column in values.T], axis=1)


def ranges(counts: NDArray[np.integer]) -> Indices:
    """0, 1, ..., c - 1 for each c of counts, concatenated."""
    return np.asarray(np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts))


def components(pairs: NDArray[np.integer], count: int) -> Indices:
    """(count,) number of the component of each of `count` things that are connected in pairs (n, 2)."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(pairs), bool), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)
