"""A table as the two-sided sheet that renderers put on meshes, and the same seen by photons."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np

from lambent.core.directions import Floats, direction
from lambent.materials.measured.protocol import MeasuredTable

DOWN = np.array([1.0, 1.0, -1.0])


@runtime_checkable
class KnowsItsBack(Protocol):
    """A table that need not be asked at random pairs, which may miss where it scatters."""

    @property
    def has_a_back(self) -> bool: ...


class Sheet:
    """A table that answers for both sides: where it has no back of its own, light from below is the mirrored pair.

    A table has a back if it says so itself, or says something of light from below (wi.z < 0) that is not the mirrored
    pair.
    """

    def __init__(self, table: MeasuredTable) -> None:
        self.table, self.info = table, table.info
        if isinstance(table, KnowsItsBack):
            self.has_a_back = table.has_a_back
            return
        z, phi = np.random.default_rng(0).uniform((0.1, 0), (1, 2 * np.pi), (2, 64, 2)).transpose(2, 0, 1)
        up, other = direction(np.arccos(z), phi)
        front = [table.eval(up, other), table.eval(up, other * DOWN)]
        back = [table.eval(up * DOWN, other * DOWN), table.eval(up * DOWN, other)]
        self.has_a_back = bool(np.any(back)) and not np.allclose(front, back, rtol=1e-3, atol=1e-6)

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., C) in 1/sr, without the cosine."""
        if not self.has_a_back:
            below = np.asarray(wi)[..., 2:] < 0
            wi, wo = np.where(below, wi * DOWN, wi), np.where(below, wo * DOWN, wo)
        return np.asarray(self.table.eval(wi, wo))


class Reversed(Sheet):
    """The sheet with light and viewer exchanged: its grid samples wo for a given wi."""

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        return super().eval(wo, wi)
