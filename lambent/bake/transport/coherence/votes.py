"""Votes of informing pixels: how many of them report a blocker, light by light."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lambent.bake.tiles import slices
from lambent.bake.transport.coherence.light_cells import CellTable
from lambent.bake.transport.coherence.order import OUTSIDE
from lambent.core.arrays import Flags, Floats, Indices

Counts = NDArray[np.uint8]
AT_ONCE = 4096  # points
NONE = -1


class Votes(Protocol):
    def keep(self, point: Indices, light: Indices, place: Floats) -> None:
        """Store blockers (n, 3) hit by shadow rays."""

    def count(self, seen: Flags, facing: Flags, point: Indices, informers: Indices) -> tuple[Counts, Counts]:
        """Numbers of blockers, and of informers that can tell, for every light of n points, (n, M).

        An informer cannot tell about a light behind its surface.

        Parameters
        ----------
        seen, facing : (P, M) bool
            Of all points.
        point : (n,)
            Points to predict.
        informers : (n, k)
            The points that inform them, padded with OUTSIDE.
        """


class Same:
    """Blockers stay in the cell of the light that they block."""

    def keep(self, point: Indices, light: Indices, place: Floats) -> None:
        """Does nothing: visibility alone is needed."""

    def count(self, seen: Flags, facing: Flags, point: Indices, informers: Indices) -> tuple[Counts, Counts]:
        votes = np.zeros((len(point), seen.shape[1]), np.uint8)
        voters = np.zeros_like(votes)
        for informer in informers.T:
            tells = facing[informer] & (informer != OUTSIDE)[:, None]
            voters += tells
            votes += tells & ~seen[informer]
        return votes, voters


class Warped:
    """Blockers are rotated to the cells that contain them from the next point."""

    def __init__(self, p: Floats, directions: Floats) -> None:
        self._p, self._cells, self._lights = p, CellTable(directions), len(directions)
        self._of = np.full((len(p), len(directions)), NONE, np.int32)  # index of each light's blocker
        self._places = np.zeros((1 << 16, 3), np.float32)  # doubled when full
        self._count = 0

    def keep(self, point: Indices, light: Indices, place: Floats) -> None:
        end = self._count + len(point)
        while end > len(self._places):
            self._places = np.concatenate([self._places, np.zeros_like(self._places)])
        self._places[self._count : end] = place
        self._of[point, light] = np.arange(self._count, end)
        self._count = end

    def count(self, seen: Flags, facing: Flags, point: Indices, informers: Indices) -> tuple[Counts, Counts]:
        votes = np.zeros((len(point), self._lights), np.uint8)
        voters = np.zeros_like(votes)
        for some in slices(len(point), AT_ONCE):
            for informer in informers[some].T:
                voters[some] += facing[informer] & (informer != OUTSIDE)[:, None]
                known = (self._of[informer] != NONE) & ~seen[informer] & (informer != OUTSIDE)[:, None]
                row, light = np.nonzero(known)
                number = self._of[informer[row], light]
                cell = self._cells.at(self._places[number] - self._p[point[some]][row])
                keys = row * self._lights + cell
                found = np.bincount(keys, minlength=votes[some].size).reshape(-1, self._lights)
                votes[some] += np.minimum(found, 50).astype(np.uint8)
                self._of[point[some][row], cell] = number
        return votes, voters
