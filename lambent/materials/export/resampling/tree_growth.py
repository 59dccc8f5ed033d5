"""Grow tensor trees that are fine where a function of directions varies.

A cell is split while its content varies by more than a tolerance, in descending order of range times volume, until all
cells are even or the tree is full. Content is known at 32 uniform places per cell and at scouts: places where light is
expected, drawn from a BSDF's lobes or measured. This finds peaks far narrower than the first cells. Cells halve a
square in which area is projected solid angle, so the mean over a cell preserves energy. In cells that stay uneven,
uniform places and drawn scouts are weighted by the sum of their densities (Veach & Guibas 1995, the balance heuristic),
so that an unresolved peak keeps its energy too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.progress import Progress
from lambent.materials.measured.parts.tensor_tree import Rank, TensorTree
from lambent.materials.measured.protocol import GRAZING_DEG

TOLERANCE = 0.1  # range of f in a cell, over its mean plus the mean of all f
MOST_CELLS: dict[Rank, int] = {3: 1 << 18, 4: 1 << 20}
DEEPEST = 12  # levels: a cell then spans 0.03 degrees
_FIRST: dict[Rank, int] = {3: 4, 4: 3}  # levels that are split unconditionally
_EVEN_LOG2 = 5  # log2 of uniform places per cell
_AT_ONCE = 1 << 12  # cells
_LEAST_BATCH = 256
_SIN_GRAZING = float(np.sin(np.radians(GRAZING_DEG)))
_STEP = "dividing directions"

Content = Callable[[Floats], Floats]
"""Values (N, C) >= 0 at places (N, rank) of the unit cube."""


@dataclass(frozen=True)
class Scouts:
    """Places where much light is expected.

    Attributes
    ----------
    place : (M, rank)
    value : (M, C)
    density : (M,) expected number of scouts per unit volume; infinite for a place not drawn by `density_at`
    density_at : callable
        The density at any places (N, rank).
    """

    place: Floats
    value: Floats
    density: Floats
    density_at: Callable[[Floats], Floats]


class Growth:
    """A tree of cells; the children of a cell are consecutive, and cell 0 is the cube.

    Attributes
    ----------
    level, corner : (N,), (N, rank)
        A cell has the side 2^-level and the lower corner `corner` times that.
    first : (N,)
        Number of a cell's first child; 0 for a leaf. The first coordinate is the lowest bit of a child's number.
    lowest, highest, mean : (N, C)
    """

    def __init__(self, rank: Rank, content: Content, scouts: Scouts, progress: Progress) -> None:
        self.rank, self._content, self._scouts = rank, content, scouts
        channels = scouts.value.shape[1]
        self._bits = (np.arange(1 << rank)[:, None] >> np.arange(rank)) & 1
        self._even = _even_places(rank)
        self._home = np.zeros(len(scouts.place), dtype=np.int64)  # the leaf of each scout
        self._glancing = _is_glancing(scouts.place)
        self.level, self.first = np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int64)
        self.corner = np.zeros((1, rank), dtype=np.int64)
        self.lowest, self.highest, self.mean = (np.zeros((1, channels)) for _ in range(3))
        for _ in range(_FIRST[rank]):
            self._split(np.flatnonzero(self.is_leaf & self._used))
        leaves = self.is_leaf & self._used
        self.typical = np.asarray(self.mean[leaves].mean(axis=0))
        most = MOST_CELLS[rank]
        while True:
            progress(len(self.level), most, _STEP)
            uneven = np.flatnonzero(self.uneven & (self.level < DEEPEST))
            room = (most - len(self.level)) >> rank
            batch = min(room, max(_LEAST_BATCH, len(self.level) >> rank))
            if len(uneven) == 0 or batch < 1:
                break
            stake = (self._spread(uneven) * self._volume(uneven)[:, None]).sum(axis=1)
            self._split(np.sort(uneven[np.argsort(-stake, kind="stable")[:batch]]))
        self._weigh(np.flatnonzero(self.uneven))
        progress(1, 1, _STEP)

    @property
    def is_leaf(self) -> Flags:
        return np.asarray(self.first == 0)

    @property
    def _used(self) -> Flags:
        """(N,) whether cells contain directions: rank 3 uses half of its first coordinate."""
        if self.rank == 4:
            return np.ones(len(self.level), dtype=bool)
        return np.asarray(2 * self.corner[:, 0] < 1 << self.level)

    @property
    def uneven(self) -> Flags:
        """(N,) whether a leaf varies by more than the tolerance."""
        spread = self.highest - self.lowest
        return np.asarray(self.is_leaf & (spread > TOLERANCE * (self.mean + self.typical)).any(axis=1))

    def _volume(self, cells: Indices) -> Floats:
        return np.asarray(np.exp2(-self.rank * self.level[cells].astype(float)))

    def _spread(self, cells: Indices) -> Floats:
        return np.asarray((self.highest[cells] - self.lowest[cells]) / np.maximum(self.typical, 1e-30))

    @property
    def uneven_share(self) -> float:
        """Share of the light that is in leaves beyond the tolerance."""
        light = self._volume(np.arange(len(self.level)))[:, None] * self.mean
        total = float(light[self.is_leaf].sum())
        return float(light[self.uneven].sum()) / total if total > 0 else 0.0

    @property
    def kept_peak(self) -> float:
        """Mean of the cell that contains the brightest value, over that value."""
        leaves = np.flatnonzero(self.is_leaf)
        peak = leaves[self.highest[leaves].sum(axis=1).argmax()]
        brightest = float(self.highest[peak].sum())
        return float(self.mean[peak].sum()) / brightest if brightest > 0 else 1.0

    @property
    def smallest_deg(self) -> float:
        """Angular width of the smallest cell, at the normal."""
        return float(np.degrees(np.sqrt(np.pi) * 0.5 ** int(self.level.max())))

    def _split(self, cells: Indices) -> None:
        count, children = len(self.level), 1 << self.rank
        self.first[cells] = count + children * np.arange(len(cells))
        corner = (2 * self.corner[cells][:, None] + self._bits).reshape(-1, self.rank)
        level = np.repeat(self.level[cells] + 1, children)
        self.corner, self.level = np.concatenate([self.corner, corner]), np.concatenate([self.level, level])
        self.first = np.concatenate([self.first, np.zeros(len(level), dtype=np.int64)])
        self._rehouse()
        moved = np.flatnonzero((self._home >= count) & ~self._glancing)
        low, high, mean = self._asked(np.arange(count, len(self.level)))
        np.minimum.at(low, self._home[moved] - count, self._scouts.value[moved])
        np.maximum.at(high, self._home[moved] - count, self._scouts.value[moved])
        self.lowest, self.highest = np.concatenate([self.lowest, low]), np.concatenate([self.highest, high])
        self.mean = np.concatenate([self.mean, mean])

    def _rehouse(self) -> None:
        """Move the scouts of split cells to the children."""
        moving = np.flatnonzero(self.first[self._home] > 0)
        below = self.level[self._home[moving]] + 1
        cell = (self._scouts.place[moving] * np.exp2(below)[:, None]).astype(np.int64) & 1
        self._home[moving] = self.first[self._home[moving]] + (cell << np.arange(self.rank)).sum(axis=1)

    def _places(self, cells: Indices) -> Floats:
        """(len(cells), even places, rank)"""
        return np.asarray((self.corner[cells][:, None] + self._even) * np.exp2(-self.level[cells])[:, None, None])

    def _asked(self, cells: Indices) -> tuple[Floats, Floats, Floats]:
        """Lowest, highest and mean (len(cells), C) at the uniform places; 0 in the unused half of rank 3.

        Grazing directions count in the mean alone; a cell with no others is even.
        """
        found = np.zeros((3, len(cells), self._scouts.value.shape[1]))
        here = np.flatnonzero(self._used[cells])
        for start in range(0, len(here), _AT_ONCE):
            part = here[start : start + _AT_ONCE]
            places = self._places(cells[part])
            value, out = self._at(places), _is_glancing(places)[..., None]
            mean = value.mean(axis=1)
            low, high = np.where(out, np.inf, value).min(axis=1), np.where(out, -np.inf, value).max(axis=1)
            found[:, part] = np.where(low <= high, low, mean), np.where(low <= high, high, mean), mean
        return found[0], found[1], found[2]

    def _at(self, places: Floats) -> Floats:
        """Content (N, K, C) of places (N, K, rank)."""
        value = self._content(places.reshape(-1, self.rank))
        return value.reshape(*places.shape[:2], -1)

    def _weigh(self, cells: Indices) -> None:
        """Means of cells from uniform places and scouts together."""
        scouts = self._scouts
        for start in range(0, len(cells), _AT_ONCE):
            part = cells[start : start + _AT_ONCE]
            places, volume, low = self._places(part), self._volume(part), self.lowest[part]
            density = scouts.density_at(places.reshape(-1, self.rank)).reshape(places.shape[:2])
            share = 1 / (len(self._even) + density * volume[:, None])
            self.mean[part] = low + ((self._at(places) - low[:, None]) * share[..., None]).sum(axis=1)
        inside = np.flatnonzero(np.isin(self._home, cells))
        home = self._home[inside]
        share = 1 / (len(self._even) + scouts.density[inside] * self._volume(home))
        np.add.at(self.mean, home, (scouts.value[inside] - self.lowest[home]) * share[:, None])

    def tree(self, value: Callable[[Floats], Floats], tolerance: float | None = None) -> TensorTree:
        """The tree of `value` (N,) of means (N, C), with cells merged where they are jointly even.

        Parameters
        ----------
        tolerance : float, optional
            Largest range of `value` in a cell; by default, `TOLERANCE` applies to the content. Cells without light
            merge with any others.
        """
        first, mean = self.first.copy(), self.mean.copy()
        low, high = self.lowest.copy(), self.highest.copy()
        if tolerance is not None:
            v, lit = value(mean)[:, None], mean.any(axis=1, keepdims=True)
            low, high = np.where(lit, v, np.inf), np.where(lit, v, -np.inf)
        children = np.arange(1 << self.rank)
        for level in range(int(self.level.max()) - 1, -1, -1):
            parents = np.flatnonzero((first > 0) & (self.level == level))
            below = first[parents][:, None] + children
            low[parents], high[parents] = low[below].min(axis=1), high[below].max(axis=1)
            mean[parents] = mean[below].mean(axis=1)
            most = TOLERANCE * (mean[parents] + self.typical) if tolerance is None else tolerance
            even = np.all(high[parents] - low[parents] <= most, axis=1) & np.all(first[below] == 0, axis=1)
            first[parents[even]] = 0
        return _tree(self.rank, first, value(mean))


def _is_glancing(place: Floats) -> Flags:
    """(...) whether light enters or leaves beyond `GRAZING_DEG`, where f can grow without limit.

    The distance of a place (..., rank) from the centre of a square, along its axes, is the sine of theta.
    """
    rank = place.shape[-1]
    sine = np.abs(2 * place - 1)
    return np.asarray(np.maximum(sine[..., : rank - 2].max(axis=-1), sine[..., rank - 2 :].max(axis=-1)) > _SIN_GRAZING)


def _even_places(rank: Rank) -> Floats:
    """(K, rank) places of the unit cube, equal numbers in each half."""
    from scipy.stats import qmc

    points = qmc.Sobol(rank, scramble=False).random_base2(_EVEN_LOG2)
    return np.asarray(points + 0.5 / len(points))


def _tree(rank: Rank, first: Indices, value: Floats) -> TensorTree:
    """The cells below cell 0 as a tree; siblings that are all leaves become a grid."""
    children = np.arange(1 << rank)
    is_leaf: Flags = np.asarray(first == 0)
    reached = [np.zeros(1, dtype=np.int64)]
    while len(parents := reached[-1][first[reached[-1]] > 0]):
        reached.append((first[parents][:, None] + children).ravel())
    cells = np.concatenate(reached)
    parents = cells[first[cells] > 0]
    flat = is_leaf[first[parents][:, None] + children].all(axis=1)
    grids, branches = parents[flat], parents[~flat]
    in_grid = np.zeros(len(first), dtype=bool)
    in_grid[first[grids][:, None] + children] = True
    alone = cells[is_leaf[cells] & ~in_grid[cells]]
    code = np.zeros(len(first), dtype=np.int64)
    code[branches] = np.arange(len(branches))
    code[np.concatenate([grids, alone])] = -1 - np.arange(len(grids) + len(alone))
    # A grid's last coordinate is fastest, but the first is a child's lowest bit: the bits are reversed.
    order = sum((children >> d & 1) << (rank - 1 - d) for d in range(rank))
    values = np.concatenate([value[first[grids][:, None] + order].ravel(), value[alone]])
    logs = np.repeat(np.array([1, 0], dtype=np.int8), [len(grids), len(alone)])
    sizes = np.left_shift(1, rank * logs.astype(np.int64))
    starts = (np.cumsum(sizes) - sizes).astype(np.int32)
    below = code[first[branches][:, None] + children].astype(np.int32)
    return TensorTree(rank, below, starts, logs, values, int(code[0]))
