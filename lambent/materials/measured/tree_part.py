"""f of one side and one way (reflection or transmission) on tensor trees, grey or in colour.

Colour is a tree of luminance and two of CIE 1976 u' and v', cut each in its own way; f is constant where all three are.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lambent.core.directions import Floats
from lambent.materials.measured.equal_energy import rgb_of_xyz, within_rec709, xyz_of_yuv
from lambent.materials.measured.tensor_tree import (
    Cells,
    Rank,
    TensorTree,
    coordinates,
    disk_of,
    incident_coordinates,
    square_of,
)

Tuples = tuple[Floats, Floats, Floats, Floats]
"""Headings of light that enters (M, 3) and leaves (M, 3), f (M, C), and the solid angle (M,) of where it leaves, sr."""

_CHUNK = 16  # queries at a time: a fine tree has tens of thousands of leaves for each
_RADII, _GRID = 32, 16  # incident directions of the tuples: rank 3, and per side of the square rank 4
_COARSEST, _THIRDS = 1 / 16, 3  # side of the largest piece of a cell that gives one tuple; pieces per side at least
_MOST_TUPLES = 500_000
_REVERSED_GRID = 32


@dataclass(frozen=True)
class TreePart:
    """One side and one way.

    Attributes
    ----------
    trees : (Y,) or (Y, u', v')
    """

    trees: tuple[TensorTree, ...]

    @property
    def rank(self) -> Rank:
        return self.trees[0].rank

    @property
    def channels(self) -> int:
        return len(self.trees)

    @property
    def dark(self) -> bool:
        """Whether f is zero throughout."""
        return not bool((self.trees[0].values > 0).any())

    @property
    def sizes(self) -> dict[str, int]:
        return {"rank": self.rank, "leaves": sum(len(tree.values) for tree in self.trees)}

    @property
    def anisotropy(self) -> float:
        """0 of rank 3, which is isotropic; infinite of rank 4, whose square has no turns."""
        return 0.0 if self.rank == 3 else np.inf

    @property
    def direct_share(self) -> float:
        """0: leaves are as small as the writer found worth it."""
        return 0.0

    @property
    def negative(self) -> int:
        """How many leaves are below zero."""
        return int((self.trees[0].values < 0).sum())

    def at(self, entering: Floats, leaving: Floats) -> Floats:
        """f (N, C) for headings (N, 3) with z >= 0."""
        return np.maximum(self._value(coordinates(self.rank, entering, leaving)), 0)

    def hemispherical(self, entering: Floats) -> Floats:
        """Share (N, C) of light with this heading that leaves: the exact sum over the leaves."""
        fixed = tuple(range(self.rank - 2))
        return self._summed(fixed, incident_coordinates(self.rank, entering))

    def hemispherical_reversed(self, leaving: Floats) -> Floats:
        """The same for light that takes the ways of this part backwards, in at the heading by which it leaves here."""
        if self.rank == 4:
            return self._summed((2, 3), square_of(leaving[:, :2]))
        radii = np.hypot(leaving[:, 0], leaving[:, 1])
        return np.array([self._summed_along(r) for r in radii]).reshape(-1, self.channels)

    def tuples(self) -> Tuples:
        """Every leaf that light of an even choice of incident directions can leave by, large ones cut."""
        if self.rank == 3:
            r = 1 - (np.arange(_RADII) + 0.5) / _RADII
            entering = _raised(np.stack([r, np.zeros(_RADII)], axis=-1))
        else:
            entering = _raised(_square_grid(_GRID))
        fixed = tuple(range(self.rank - 2))
        cells = [
            _thinned(_cut(self._cells(fixed, place[None])), _MOST_TUPLES // len(entering))
            for place in incident_coordinates(self.rank, entering)
        ]
        light = np.repeat(entering, [len(c.side) for c in cells], axis=0)
        middle = np.concatenate([c.middle for c in cells])
        area = np.concatenate([c.side for c in cells]) ** 2
        leaving = _raised(disk_of(middle))
        if self.rank == 3:  # the entering heading lies at phi = 0, as the tree has it
            place = np.column_stack([incident_coordinates(3, light), middle])
        else:
            place = np.column_stack([square_of(light[:, :2]), middle])
        return light, leaving, self._value(place), np.pi * area / leaving[:, 2]

    def tuples_reversed(self) -> Tuples:
        """Tuples of the ways backwards, on a regular grid; entering and leaving are those of the light that goes so."""
        entering = _raised(_square_grid(_GRID)) if self.rank == 4 else _raised(_radii(_RADII))
        out = _raised(_square_grid(_REVERSED_GRID))
        light, leaving = np.repeat(entering, len(out), axis=0), np.tile(out, (len(entering), 1))
        f = self.at(leaving * (-1, -1, 1), light * (-1, -1, 1))
        return light, leaving, f, np.pi / (_REVERSED_GRID**2 * leaving[:, 2])

    def _value(self, place: Floats) -> Floats:
        """(N, C), negative where the luminance is."""
        y, *chroma = (tree.look_up(place)[0] for tree in self.trees)
        if not chroma:
            return y[:, None]
        rgb = within_rec709(rgb_of_xyz(xyz_of_yuv(y, *chroma)))
        return np.asarray(np.where(y[:, None] < 0, -1.0, rgb))

    def _summed(self, fixed: tuple[int, ...], place: Floats) -> Floats:
        total = np.zeros((len(place), self.channels))
        free = tuple(d for d in range(self.rank) if d not in fixed)
        for start in range(0, len(place), _CHUNK):
            here = place[start : start + _CHUNK]
            cells = self._cells(fixed, here)
            at = np.empty((len(cells.side), self.rank))
            at[:, list(fixed)], at[:, list(free)] = here[cells.query], cells.middle
            f = np.maximum(self._value(at), 0)
            for c in range(self.channels):
                weighted = np.bincount(cells.query, f[:, c] * cells.side**2, minlength=len(here))
                total[start : start + _CHUNK, c] = np.pi * weighted
        return total

    def _cells(self, fixed: tuple[int, ...], place: Floats) -> Cells:
        """The cells on which all trees are constant.

        A leaf of one tree is one of them where no other tree is finer in its middle: leaves are nested or apart, and a
        tree that cuts a leaf has all its own leaves there smaller. Equal leaves count in the first tree alone.
        """
        kept = []
        for k, tree in enumerate(self.trees):
            cells = tree.walk(fixed, place)
            keep = np.ones(len(cells.side), dtype=bool)
            for j, other in enumerate(self.trees):
                if j != k:
                    side = _side_at(other, fixed, place[cells.query], cells.middle)
                    keep &= cells.side < side if j < k else cells.side <= side
            kept.append(cells.chosen(keep))
        return Cells.joined(kept)

    @cached_property
    def _backwards(self) -> tuple[Floats, Floats, Floats]:
        """Of rank 3: lower and upper corners (M, 2) of the leaves in [-1, 1]^2, and f (M, C) times their ring r dr."""
        cells = self._cells((), np.zeros((1, 0)))
        cells = cells.chosen(cells.corner[:, 0] < 0.5)
        low, high = cells.corner, cells.corner + cells.side[:, None]
        r_high, r_low = 1 - 2 * low[:, 0], (1 - 2 * high[:, 0]).clip(0, 1)
        f = np.maximum(self._value(cells.middle), 0)
        return 2 * low[:, 1:] - 1, 2 * high[:, 1:] - 1, f * ((r_high**2 - r_low**2) / 2)[:, None]

    def _summed_along(self, radius: float) -> Floats:
        """(C,) of rank 3 backwards.

        Light that comes in at sin(theta) = radius meets, over all it can leave by, the places of a circle of that
        radius; the disk map makes it the outline of a square and keeps the angle linear along each side. What a leaf
        gets is its part of the outline times the ring r dr of its first coordinate.
        """
        low, high, f_ring = self._backwards
        return np.asarray(_outline(low, high, max(radius, 1e-9)) @ f_ring)


def _outline(low: Floats, high: Floats, half: float) -> Floats:
    """(M,) angle, in radians of a whole turn, of the outline of [-half, half]^2 within boxes (M, 2) of [-1, 1]^2."""
    length = np.zeros(len(low))
    for across, along in ((0, 1), (1, 0)):
        overlap = (np.minimum(high[:, along], half) - np.maximum(low[:, along], -half)).clip(0, None)
        for edge in (-half, half):
            length += np.where((low[:, across] <= edge) & (edge < high[:, across]), overlap, 0)
        length += np.where((half == 1) & (high[:, across] == 1), overlap, 0)
    return np.asarray(length * (np.pi / 4) / half)


def _side_at(tree: TensorTree, fixed: tuple[int, ...], at: Floats, middle: Floats) -> Floats:
    place = np.empty((len(middle), tree.rank))
    place[:, list(fixed)] = at
    place[:, [d for d in range(tree.rank) if d not in fixed]] = middle
    return tree.look_up(place)[1]


def _cut(cells: Cells) -> Cells:
    """The cells cut into nine, and large ones into pieces of at most `_COARSEST`.

    Nine, because at its middle alone a lobe far narrower than the cell would fit, with any energy.
    """
    parts = np.maximum(np.round(cells.side / _COARSEST), _THIRDS).astype(np.int64)
    pieces = []
    for n in np.unique(parts):
        whole = cells.chosen(parts == n)
        steps = np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), axis=-1).reshape(-1, 2)
        corner = (whole.corner[:, None] + steps * (whole.side[:, None, None] / n)).reshape(-1, 2)
        query, side, value = (np.repeat(x, n * n) for x in (whole.query, whole.side / n, whole.value))
        pieces.append(Cells(query, corner, side, value))
    return Cells.joined(pieces)


def _thinned(cells: Cells, most: int) -> Cells:
    """An even, deterministic choice of at most `most`."""
    if len(cells.side) <= most:
        return cells
    chosen = ((np.arange(most) + np.random.default_rng(0).random(most)) * (len(cells.side) / most)).astype(np.int64)
    return cells.chosen(chosen)


def _square_grid(n: int) -> Floats:
    """(n^2, 2) points of the disk in the middle of n x n cells of the square."""
    line = (np.arange(n) + 0.5) / n
    return disk_of(np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2))


def _radii(n: int) -> Floats:
    r = 1 - (np.arange(n) + 0.5) / n
    return np.stack([r, np.zeros(n)], axis=-1)


def _raised(disk: Floats) -> Floats:
    """Unit directions (N, 3) above points (N, 2) of the disk."""
    z = np.sqrt(np.maximum(1 - np.sum(disk**2, axis=-1), 0))
    return np.concatenate([disk, z[:, None]], axis=-1)
