"""A table as the two-sided sheet that renderers put on meshes, and with light and viewer swapped."""

from __future__ import annotations

import numpy as np

from lambent.core.geometry.directions import FLIP_Z, Floats, direction
from lambent.materials.measured.protocol import MeasuredTable


class TwoSided:
    """A table for light from both sides; without its own back, it treats light from below as the mirrored pair.

    The attribute `has_a_back`, if present, decides. Otherwise the table has a back if, at random pairs, f for light
    from below (wi.z < 0) differs from that of the mirrored pair.
    """

    def __init__(self, table: MeasuredTable) -> None:
        self.table, self.info = table, table.info
        stated: bool | None = getattr(table, "has_a_back", None)
        if stated is not None:
            self.has_a_back = stated
            return
        z, phi = np.random.default_rng(0).uniform((0.1, 0), (1, 2 * np.pi), (2, 64, 2)).transpose(2, 0, 1)
        up, other = direction(np.arccos(z), phi)
        front = [table.eval(up, other), table.eval(up, other * FLIP_Z)]
        back = [table.eval(up * FLIP_Z, other * FLIP_Z), table.eval(up * FLIP_Z, other)]
        self.has_a_back = bool(np.any(back)) and not np.allclose(front, back, rtol=1e-3, atol=1e-6)

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., C) in 1/sr, without the cosine."""
        if not self.has_a_back:
            below = np.asarray(wi)[..., 2:] < 0
            wi, wo = np.where(below, wi * FLIP_Z, wi), np.where(below, wo * FLIP_Z, wo)
        return np.asarray(self.table.eval(wi, wo))


class Reversed(TwoSided):
    """The sheet with light and viewer swapped; its grid samples wo for a given wi."""

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        return super().eval(wo, wi)
