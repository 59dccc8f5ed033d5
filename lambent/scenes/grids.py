"""Calculation surfaces: grids of points where illuminance is calculated, on surfaces or in free space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Flags, Floats


@dataclass(frozen=True, eq=False)
class Grid:
    """Points at the centres of the cells of a parallelogram from `corner` (3,), m, that face the unit `normal` (3,).

    Columns run along edges[0], rows along edges[1] of `edges` (2, 3), m; cells not `inside` (rows, columns) are none.
    """

    name: str
    corner: Floats
    edges: Floats
    normal: Floats
    inside: Flags

    @property
    def points(self) -> Floats:
        """World positions (n, 3), m, row after row."""
        share = (np.argwhere(self.inside)[:, ::-1] + 0.5) / self.inside.shape[::-1]
        return np.asarray(self.corner + share @ self.edges)
