"""Radiance's tensor trees: f constant over cells of a disk map, finer where it varies.

A direction is a point in the unit square: its projection on the sheet, a point of the unit disk, is mapped to the
square by the equal-area map of Shirley & Chiu 1997, "A low distortion map between disk and square". A cell of side s
therefore has the projected solid angle pi s^2. Rank 4 has the incident heading and the outgoing direction. Rank 3 is
isotropic: its first coordinate is (1 - sin theta_i) / 2, of which only [0, 1/2] is used, and the outgoing direction is
turned to put the incident heading at phi = 0.

As text, a tree is nested braces. Braces in braces are the 2^rank children of a cell; the first coordinate is the lowest
bit of a child's number. Numbers in braces are a grid of 2^(rank k) leaves, with the last coordinate fastest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags, Floats, Indices, numbers_in

Rank = Literal[3, 4]

DEEPEST = 24  # levels; a cell of that size is far below the resolution of any device or sampler
_TINY = 1e-6  # keeps the normal within the used half of rank 3, as Radiance does
_BELOW_ONE = 1 - 2**-40
_OPEN, _CLOSE = ord("{"), ord("}")
_BLANKS = b" \t\r\n\f\v,"
_BLANKED = bytes.maketrans(b",{}", b"   ")
_IN_WORD = np.array([letter not in _BLANKS + b"{}" for letter in range(256)])
_CHUNK = 1 << 16  # letters of a text at a time


class Malformed(ValueError):
    """The text does not follow the format; the message says why."""


def disk_of(square: Floats) -> Floats:
    """Points (..., 2) of the unit disk for points of [0, 1]^2."""
    a, b = 2 * square[..., 0] - 1, 2 * square[..., 1] - 1
    wide = np.abs(a) > np.abs(b)
    r = np.where(wide, a, b)  # signed: the opposite quadrant is the same one turned by 180 degrees
    ratio = np.divide(np.where(wide, b, a), r, out=np.zeros_like(r), where=r != 0)
    phi = np.pi / 4 * np.where(wide, ratio, 2 - ratio)
    return np.stack([r * np.cos(phi), r * np.sin(phi)], axis=-1)


def square_of(disk: Floats) -> Floats:
    """Points (..., 2) of [0, 1]^2 for points of the unit disk: the inverse of `disk_of`."""
    r = np.hypot(disk[..., 0], disk[..., 1])
    phi = np.arctan2(disk[..., 1], disk[..., 0])
    phi = np.where(phi < -np.pi / 4, phi + 2 * np.pi, phi)
    quadrant = np.floor((phi + np.pi / 4) / (np.pi / 2)).astype(np.int64).clip(0, 3)
    along = r * (phi - quadrant * (np.pi / 2)) / (np.pi / 4)
    a = np.choose(quadrant, [r, -along, -r, along])
    b = np.choose(quadrant, [along, r, -along, -r])
    return np.stack([(a + 1) / 2, (b + 1) / 2], axis=-1)


def coordinates(rank: Rank, entering: Floats, leaving: Floats) -> Floats:
    """Places (N, rank) in the unit cube for headings (N, 3) of light that enters and leaves."""
    out = leaving[:, :2]
    if rank == 3:
        turn = -np.arctan2(entering[:, 1], entering[:, 0])
        cos, sin = np.cos(turn), np.sin(turn)
        x, y = leaving[:, 0], leaving[:, 1]
        out = np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)
    return np.concatenate([incident_coordinates(rank, entering), square_of(out)], axis=1)


def incident_coordinates(rank: Rank, entering: Floats) -> Floats:
    """The first rank - 2 coordinates (N, rank - 2)."""
    if rank == 4:
        return square_of(entering[:, :2])
    return np.asarray(0.5 - _TINY - 0.5 * np.hypot(entering[:, 0], entering[:, 1]))[:, None]


def grid_points(size: int, dimensions: int) -> Indices:
    """(size^dimensions, dimensions) integer points of a cube, with the last coordinate fastest."""
    return np.indices((size,) * dimensions).reshape(dimensions, -1).T


@dataclass(frozen=True)
class Cells:
    """Leaves that queries intersect, one entry per query and leaf.

    Attributes
    ----------
    query : (M,) number of the query
    corner : (M, D) lower corner in the free coordinates
    side : (M,) length of the side
    value : (M,)
    """

    query: Indices
    corner: Floats
    side: Floats
    value: Floats

    @property
    def middle(self) -> Floats:
        """(M, D)"""
        return np.asarray(self.corner + self.side[:, None] / 2)

    def chosen(self, index: NDArray[Any]) -> Cells:
        """The cells of an index or of flags."""
        return Cells(self.query[index], self.corner[index], self.side[index], self.value[index])

    @staticmethod
    def joined(parts: Sequence[Cells]) -> Cells:
        """The parts, concatenated."""
        columns = zip(*((c.query, c.corner, c.side, c.value) for c in parts), strict=True)
        return Cells(*(np.concatenate(column) for column in columns))


@dataclass(frozen=True)
class TensorTree:
    """Piecewise constant function on the unit cube.

    Attributes
    ----------
    rank : 3 or 4
    children : (B, 2^rank) int32
        Code of the node below each branch and half: k >= 0 is branch k, -1 - k is grid k.
    starts : (K,) int32
        Index of each grid's first value.
    logs : (K,) int8
        Base-2 logarithm of each grid's leaves per side.
    values : (V,)
    root : int
        Code of the root.
    """

    rank: Rank
    children: NDArray[np.int32]
    starts: NDArray[np.int32]
    logs: NDArray[np.int8]
    values: Floats
    root: int

    def _free(self, fixed: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(d for d in range(self.rank) if d not in fixed)

    def look_up(self, place: Floats) -> tuple[Floats, Floats]:
        """Value (N,) and side (N,) of the leaf at places (N, rank) in the unit cube."""
        at = place.clip(0, _BELOW_ONE)
        code = np.full(len(at), self.root)
        side = np.ones(len(at))
        bits = 1 << np.arange(self.rank)
        active = np.flatnonzero(code >= 0)
        while len(active):
            doubled = 2 * at[active]
            upper = doubled >= 1
            at[active] = doubled - upper
            side[active] /= 2
            code[active] = self.children[code[active], upper @ bits]
            active = active[code[active] >= 0]
        grid = -1 - code
        log = self.logs[grid].astype(np.int64)
        cell = (at * (1 << log)[:, None]).astype(np.int64)
        index = self.starts[grid].astype(np.int64)
        for d in range(self.rank):
            index = index + (cell[:, d] << log * (self.rank - 1 - d))
        return self.values[index], side / (1 << log)

    def walk(self, fixed: tuple[int, ...], place: Floats) -> Cells:
        """The leaves that each query intersects; a query fixes some coordinates and leaves the others free.

        Parameters
        ----------
        fixed : tuple of int
            Indices of the fixed coordinates.
        place : (Q, len(fixed)) in [0, 1]
        """
        free = self._free(fixed)
        halves = grid_points(2, len(free))
        query, at = np.arange(len(place)), place.clip(0, _BELOW_ONE)
        code, corner, side = np.full(len(place), self.root), np.zeros((len(place), len(free))), 1.0
        found = []
        while len(query):
            leaf = code < 0
            found.append(self._grids(fixed, query[leaf], at[leaf], -1 - code[leaf], corner[leaf], side))
            query, at, code, corner, side = query[~leaf], 2 * at[~leaf], code[~leaf], corner[~leaf], side / 2
            upper = at >= 1
            at = at - upper
            branch = (upper << np.array(fixed, dtype=np.int64)).sum(axis=1)[:, None] + halves @ (1 << np.array(free))
            code = self.children[code[:, None], branch].ravel()
            corner = (corner[:, None, :] + halves * side).reshape(-1, len(free))
            query, at = (np.repeat(x, len(halves), axis=0) for x in (query, at))
        return Cells.joined([cells for level in found for cells in level])

    def _grids(
        self, fixed: tuple[int, ...], query: Indices, at: Floats, grid: Indices, corner: Floats, side: float
    ) -> list[Cells]:
        """The leaves of grids (Q,), which fill cells with these corners and this side."""
        free = self._free(fixed)
        cells = [Cells(query[:0], corner[:0], np.zeros(0), np.zeros(0))]
        for log in np.unique(self.logs[grid]).tolist():
            here = self.logs[grid] == log
            width = 1 << log
            index = self.starts[grid[here]].astype(np.int64)
            for column, d in enumerate(fixed):
                index = index + ((at[here, column] * width).astype(np.int64) << log * (self.rank - 1 - d))
            steps = grid_points(width, len(free))
            offset = (steps << log * (self.rank - 1 - np.array(free))).sum(axis=1)
            value = self.values[index[:, None] + offset].ravel()
            corners = (corner[here, None, :] + steps * (side / width)).reshape(-1, len(free))
            queries = np.repeat(query[here], len(steps))
            cells.append(Cells(queries, corners, np.full(len(value), side / width), value))
        return cells


def parse_tree(text: bytes, rank: Rank) -> TensorTree:
    """Parse the tree of a text.

    Raises
    ------
    Malformed
        If braces do not match, a number of branches or values is impossible, or a word is not a number.
    """
    opens, words = _braces(text)
    depth = np.cumsum(np.where(opens, np.int8(1), np.int8(-1)), dtype=np.int32)
    _check_nesting(opens, words, depth)
    branches, node = 1 << rank, np.flatnonzero(opens)
    leaf, level = ~opens[node + 1], depth[node]
    counts = words[node[leaf] + 1]
    logs = np.round(np.log2(np.maximum(counts, 1)) / rank).astype(np.int8)
    sizes = np.left_shift(1, rank * logs, dtype=np.int32)  # no grid is longer than the text
    if (counts != sizes).any():
        raise Malformed(f"{counts[counts != sizes][0]} values in braces, expected a power of {branches}")
    code = np.where(leaf, -np.cumsum(leaf, dtype=np.int32), np.cumsum(~leaf, dtype=np.int32) - 1)
    children = np.empty((int((~leaf).sum()), branches), np.int32)
    for deep in range(1, int(level.max())):
        above, below = np.flatnonzero((level == deep) & ~leaf), np.flatnonzero(level == deep + 1)
        found = np.bincount(np.searchsorted(above, below) - 1, minlength=len(above))
        if (found > branches).any():
            raise Malformed(f"more than {branches} branches in braces")
        if (found < branches).any():
            raise Malformed(f"{branches} branches expected in braces, found {found.min()}")
        children[code[above]] = code[below].reshape(-1, branches)
    values = numbers_of(text)
    if len(values) != sizes.sum():
        raise Malformed("a word that is not a number")
    return TensorTree(rank, children, np.cumsum(sizes, dtype=np.int32) - sizes, logs, values, int(code[0]))


def _check_nesting(opens: Flags, words: Indices, depth: NDArray[np.int32]) -> None:
    """Raise `Malformed` if braces do not match or words are outside the innermost; `depth` is that after each brace."""
    if words[-1]:
        raise Malformed("text after the last brace")
    if len(opens) == 0:
        raise Malformed("no braces")
    if depth.max() > DEEPEST + 1:
        raise Malformed(f"more than {DEEPEST} levels of braces")
    end = int(np.argmax(depth <= 0))
    if depth[end] > 0:
        raise Malformed("a brace that is not closed")
    if depth[end] < 0 or end + 1 < len(depth):
        raise Malformed("text after the last brace" if depth[end] == 0 and opens[end + 1] else "a brace too many")
    closes_leaf = np.append(False, opens[:-1] & ~opens[1:])
    stray = np.flatnonzero((words[:-1] > 0) & ~closes_leaf)
    if len(stray):
        before_branch = opens[stray[0]]
        raise Malformed(
            "a number outside the innermost braces" if before_branch else "a number beside branches in braces"
        )


def _braces(text: bytes) -> tuple[Flags, Indices]:
    """Whether each brace opens (K,), and the numbers (K + 1,) of words between braces; in chunks, to save memory."""
    opens, words, rest = [np.zeros(0, bool)], [np.zeros(0, np.int32)], 0
    for start in range(0, len(text), _CHUNK):
        letters = np.frombuffer(text, np.uint8)[start : start + _CHUNK]
        begins = _word_starts(letters, text[start - 1] if start else _BLANKS[0])
        braces = np.flatnonzero((letters == _OPEN) | (letters == _CLOSE))
        between = np.add.reduceat(begins, np.append(0, braces), dtype=np.int32)
        between[0] += rest
        opens.append(letters[braces] == _OPEN)
        words.append(between[:-1])
        rest = int(between[-1])
    return np.concatenate(opens), np.append(np.concatenate(words), rest)


def _word_starts(letters: NDArray[np.uint8], before: int) -> Flags:
    """Whether a word begins at each letter; `before` is the letter before the first."""
    inside = _IN_WORD[letters]
    starts = inside.copy()
    starts[1:] &= ~inside[:-1]
    starts[0] &= not _IN_WORD[before]
    return starts


def count_words(text: bytes) -> int:
    """Number of words between blanks, commas and braces, without creating them."""
    return int(_word_starts(np.frombuffer(text, np.uint8), _BLANKS[0]).sum()) if text else 0


def numbers_of(text: bytes) -> Floats:
    """The numbers (N,) of a text, separated by blanks, commas or braces.

    Raises
    ------
    Malformed
        A word is not a number.
    """
    found = numbers_in(text.translate(_BLANKED))
    if found is None:
        raise Malformed("a word that is not a number")
    return found
