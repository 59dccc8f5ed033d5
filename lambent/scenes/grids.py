"""Calculation surfaces: grids of points where illuminance is calculated, on surfaces or in free space."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.triangles import area_vectors

BAND_M, BAND_SHARE = 0.5, 0.15  # along the outline of an object (EN 12464-1), and most of it, of the shorter side
WORKPLANE_M = 0.75  # height above a floor
MOST_CELL_M = 10.0
LEVEL_COS, LEVEL_M = 0.985, 0.01  # of a top: slope of its triangles, and difference in height from one to the next
AS_LARGE = 0.8  # share of the largest level's area from which another counts as as large
RASTER = 1024  # cells along the longer side of an outline


@dataclass(frozen=True, eq=False)
class Grid:
    """Points at the centres of the cells of a parallelogram.

    It begins at `corner` (3,), m; columns run along edges[0], rows along edges[1] of `edges` (2, 3), m. Points face
    the unit `normal` (3,); cells that are not `inside` (rows, columns) have none.
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

    @property
    def size_m(self) -> Floats:
        """Lengths (2,) of the edges."""
        return np.asarray(np.linalg.norm(self.edges, axis=1))


def cells_of(size_m: Floats, spacing_m: float | None = None) -> tuple[int, int]:
    """Numbers of cells along both sides (2,), m: of about `spacing_m`, by default as in EN 12464-1 (2011), 4.4.

    Cells are about .2 m 5^(log10 d) wide, with d the longer side, or the shorter one if the longer is twice as long.
    """
    short, long = sorted(map(float, size_m))
    if spacing_m is None:
        d = short if long >= 2 * short else long
        spacing_m = d / max(round(d / min(0.2 * 5 ** math.log10(d), MOST_CELL_M)), 1)
    columns, rows = (max(round(float(side) / spacing_m), 1) for side in size_m)
    return columns, rows


def top_of(corners: Floats) -> Floats:
    """Triangles (K, 3, 3) of an object's (F, 3, 3) largest level that faces up; of equals the lowest: floor, not roof.

    Empty for an object without level triangles.
    """
    vectors = area_vectors(corners)
    areas = np.linalg.norm(vectors, axis=1)
    level = np.abs(vectors[:, 1]) > LEVEL_COS * np.maximum(areas, 1e-30)
    up = level & (vectors[:, 1] > 0)
    chosen = np.flatnonzero(up if up.any() else level)  # a sheet may be modelled upside down
    heights = corners[chosen, :, 1].mean(axis=1)
    steps = np.flatnonzero(np.diff(np.sort(heights)) > LEVEL_M) + 1
    levels = np.split(chosen[np.argsort(heights, kind="stable")], steps)
    most = max(areas[one].sum() for one in levels)
    return np.asarray(corners[next(one for one in levels if areas[one].sum() >= AS_LARGE * most)])


def within(outline: Floats, points: Floats, margin_m: float) -> Flags:
    """Whether plane points (N, 2) lie in triangles (K, 3, 2), and `margin_m` away from the outline of all of them.

    Both are exact to a cell of the raster; gaps between triangles that are narrower do not count.
    """
    from scipy.ndimage import binary_closing, distance_transform_edt

    from lambent.core.geometry.plan_cells import filled  # compiled, and needed only for grids on objects

    low, size = outline.min(axis=(0, 1)), np.ptp(outline, axis=(0, 1))
    cell = float(size.max()) / RASTER
    columns, rows = (np.ceil(size / cell).astype(int) + 4).tolist()
    covered = binary_closing(filled((outline - low) / cell + 1.5, rows, columns), np.ones((3, 3)))
    column, row = np.floor((points - low) / cell + 2).astype(int).T
    depth_m = distance_transform_edt(covered)[row, column] * cell
    return np.asarray(covered[row, column] & (depth_m > margin_m - 1.5 * cell))
