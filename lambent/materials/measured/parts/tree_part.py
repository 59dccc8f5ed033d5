"""f of reflection or transmission on one side as tensor trees, grey or in colour.

Colour is a tree of luminance and two of CIE 1976 u' and v', each with its own cells; f is constant over intersections
of their cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from lambent.core.arrays import sums_of
from lambent.core.geometry.directions import HALF_TURN, Floats
from lambent.materials.measured.parts.spectral import rgb_of_equal_energy, within_rec709, xyz_of_yuv
from lambent.materials.measured.parts.tensor_tree import (
    Cells,
    Rank,
    TensorTree,
    coordinates,
    disk_of,
    grid_points,
    incident_coordinates,
    square_of,
)
from lambent.materials.measured.protocol import even_choice

Tuples = tuple[Floats, Floats, Floats, Floats]
"""Headings of light that enters (M, 3) and leaves (M, 3), f (M, C), and the outgoing solid angle (M,) in sr."""

_CHUNK = 16  # queries at a time: a fine tree has tens of thousands of leaves per query
_RADII, _GRID = 32, 16  # number of incident directions of the tuples: for rank 3, and per side of the square for rank 4
_COARSEST, _THIRDS = 1 / 16, 3  # side of a cell's largest piece per tuple; least pieces per side
_MOST_TUPLES = 500_000
_REVERSED_GRID = 32


@dataclass(frozen=True)
class TreePart:
    """Reflection or transmission on one side.

    Attributes
    ----------
    trees : (Y,) or (Y, u', v')
    """

    trees: tuple[TensorTree, ...]
    direct_share: ClassVar[float] = 0.0  # leaves are as small as the lobes need

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
        """0 for rank 3, which is isotropic; infinite for rank 4, whose square cannot be rotated."""
        return 0.0 if self.rank == 3 else np.inf

    @property
    def negative(self) -> int:
        """Number of leaves below zero."""
        return int((self.trees[0].values < 0).sum())

    def at(self, entering: Floats, leaving: Floats) -> Floats:
        """f (N, C) for headings (N, 3) with z >= 0."""
        return np.maximum(self._value(coordinates(self.rank, entering, leaving)), 0)

    def hemispherical(self, entering: Floats) -> Floats:
        """Share (N, C) of light with this heading that is scattered: the exact sum over the leaves."""
        fixed = tuple(range(self.rank - 2))
        return self._summed(fixed, incident_coordinates(self.rank, entering))

    def hemispherical_reversed(self, leaving: Floats) -> Floats:
        """Likewise for reversed light, which enters at a heading by which light of this part leaves."""
        if self.rank == 4:
            return self._summed((2, 3), square_of(leaving[:, :2]))
        radii = np.hypot(leaving[:, 0], leaving[:, 1])
        return np.array([self._summed_along(r) for r in radii]).reshape(-1, self.channels)

    def tuples(self) -> Tuples:
        """All leaves by which light of a uniform choice of incident directions can leave; large leaves are divided."""
        entering = self._even_incident()
        fixed = tuple(range(self.rank - 2))
        most, cells = _MOST_TUPLES // len(entering), []
        for place in incident_coordinates(self.rank, entering):
            pieces = _cut(self._cells(fixed, place[None]))
            count = len(pieces.side)
            cells.append(pieces if count <= most else pieces.chosen(even_choice(count, most)))
        light = np.repeat(entering, [len(c.side) for c in cells], axis=0)
        middle = np.concatenate([c.middle for c in cells])
        area = np.concatenate([c.side for c in cells]) ** 2
        leaving = on_sphere(disk_of(middle))
        place = np.column_stack([incident_coordinates(self.rank, light), middle])
        return light, leaving, self._value(place), np.pi * area / leaving[:, 2]

    def tuples_reversed(self) -> Tuples:
        """Tuples of reversed light on a regular grid; `entering` and `leaving` are its own headings."""
        entering, out = self._even_incident(), on_sphere(_square_grid(_REVERSED_GRID))
        light, leaving = np.repeat(entering, len(out), axis=0), np.tile(out, (len(entering), 1))
        f = self.at(leaving * HALF_TURN, light * HALF_TURN)
        return light, leaving, f, np.pi / (_REVERSED_GRID**2 * leaving[:, 2])

    def _even_incident(self) -> Floats:
        """(N, 3) uniform headings of incident light; at phi = 0 for rank 3, as in the tree."""
        if self.rank == 4:
            return on_sphere(_square_grid(_GRID))
        r = 1 - (np.arange(_RADII) + 0.5) / _RADII
        return on_sphere(np.stack([r, np.zeros(_RADII)], axis=-1))

    def _value(self, place: Floats) -> Floats:
        """(N, C), negative and grey where the luminance is."""
        y, *chroma = (tree.look_up(place)[0] for tree in self.trees)
        if not chroma:
            return y[:, None]
        rgb = within_rec709(rgb_of_equal_energy(xyz_of_yuv(y, *chroma)))
        return np.asarray(np.where(y[:, None] < 0, y[:, None], rgb))

    def _summed(self, fixed: tuple[int, ...], place: Floats) -> Floats:
        total = np.zeros((len(place), self.channels))
        for start in range(0, len(place), _CHUNK):
            here = place[start : start + _CHUNK]
            cells = self._cells(fixed, here)
            f = np.maximum(self._value(_composed(self.rank, fixed, here[cells.query], cells.middle)), 0)
            total[start : start + _CHUNK] = np.pi * sums_of(f * cells.side[:, None] ** 2, cells.query, len(here))
        return total

    def _cells(self, fixed: tuple[int, ...], place: Floats) -> Cells:
        """The cells over which all trees are constant.

        A leaf of one tree is such a cell if no other tree is finer at its centre: leaves are nested or disjoint, and a
        tree that divides a leaf has only smaller leaves there. Of equal leaves, the first tree's is used.
        """
        kept = []
        for k, tree in enumerate(self.trees):
            cells = tree.walk(fixed, place)
            keep = np.ones(len(cells.side), dtype=bool)
            for j, other in enumerate(self.trees):
                if j != k:
                    _, side = other.look_up(_composed(other.rank, fixed, place[cells.query], cells.middle))
                    keep &= cells.side < side if j < k else cells.side <= side
            kept.append(cells.chosen(keep))
        return Cells.joined(kept)

    @cached_property
    def _backwards(self) -> tuple[Floats, Floats, Floats]:
        """For rank 3: lower and upper corners (M, 2) of the leaves in [-1, 1]^2, and f (M, C) times their ring r dr."""
        cells = self._cells((), np.zeros((1, 0)))
        cells = cells.chosen(cells.corner[:, 0] < 0.5)
        low, high = cells.corner, cells.corner + cells.side[:, None]
        r_high, r_low = 1 - 2 * low[:, 0], (1 - 2 * high[:, 0]).clip(0, 1)
        f = np.maximum(self._value(cells.middle), 0)
        return 2 * low[:, 1:] - 1, 2 * high[:, 1:] - 1, f * ((r_high**2 - r_low**2) / 2)[:, None]

    def _summed_along(self, radius: float) -> Floats:
        """Share (C,) of reversed light that is scattered, for rank 3.

        Light that enters at sin(theta) = radius can leave by a circle of that radius over all directions. The disk map
        turns the circle into the outline of a square and keeps the angle linear along each side. A leaf's share is its
        part of the outline times the ring r dr of its first coordinate.
        """
        low, high, f_ring = self._backwards
        return np.asarray(_outline(low, high, max(radius, 1e-9)) @ f_ring)


def _outline(low: Floats, high: Floats, half: float) -> Floats:
    """(M,) angle in radians of the part of the outline of [-half, half]^2 within boxes (M, 2) of [-1, 1]^2."""
    length = np.zeros(len(low))
    for across, along in ((0, 1), (1, 0)):
        overlap = (np.minimum(high[:, along], half) - np.maximum(low[:, along], -half)).clip(0, None)
        for edge in (-half, half):
            length += np.where((low[:, across] <= edge) & (edge < high[:, across]), overlap, 0)
        length += np.where((half == 1) & (high[:, across] == 1), overlap, 0)
    return np.asarray(length * (np.pi / 4) / half)


def _composed(rank: Rank, fixed: tuple[int, ...], at: Floats, middle: Floats) -> Floats:
    """Places (N, rank) composed of fixed coordinates and the others."""
    place = np.empty((len(middle), rank))
    place[:, list(fixed)] = at
    place[:, [d for d in range(rank) if d not in fixed]] = middle
    return place


def _cut(cells: Cells) -> Cells:
    """The cells divided into nine, and large ones into pieces of at most `_COARSEST`.

    With one tuple per cell, a lobe far narrower than the cell would fit with any energy.
    """
    parts = np.maximum(np.round(cells.side / _COARSEST), _THIRDS).astype(np.int64)
    pieces = []
    for n in np.unique(parts):
        whole = cells.chosen(parts == n)
        corner = (whole.corner[:, None] + grid_points(n, 2) * (whole.side[:, None, None] / n)).reshape(-1, 2)
        query, side, value = (np.repeat(x, n * n) for x in (whole.query, whole.side / n, whole.value))
        pieces.append(Cells(query, corner, side, value))
    return Cells.joined(pieces)


def _square_grid(n: int) -> Floats:
    """(n^2, 2) points of the disk at the centres of n x n cells of the square."""
    return disk_of((grid_points(n, 2) + 0.5) / n)


def on_sphere(disk: Floats) -> Floats:
    """Unit directions (N, 3) above points (N, 2) of the disk."""
    z = np.sqrt(np.maximum(1 - np.sum(disk**2, axis=-1), 0))
    return np.concatenate([disk, z[:, None]], axis=-1)
