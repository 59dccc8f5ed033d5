"""Calculation surfaces: grids of points where illuminance is calculated, on surfaces or in free space.

Cells by EN 12464-1 (2011), 4.4, unless a spacing is given: at most p = .2 m 5^(log10 d), d the longer side in metres, or
the shorter one of areas twice as long as wide; points lie at the cells' centres. On an object a band of .5 m along its
edges is left out, in narrow areas BAND_SHARE of the shorter side.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.ceilings import GRID_POINTS
from lambent.core.errors import UserError
from lambent.core.geometry.triangles import area_vectors, cross_2d

BAND_M, BAND_SHARE = 0.5, 0.15
WORKPLANE_M = 0.75  # height above a floor
MOST_CELL_M = 10.0
LEAST_AREA_M2 = 1e-6
FLAT_DEG = 10.0  # slope of what still counts as the top of an object
LEVEL_M = 0.01  # triangles of a top differ by less from one to the next
LARGE = 0.5  # share of the largest level's area from which a level may be the top
RASTER = 1024  # cells along the longer side of an outline


@dataclass(frozen=True)
class Place:
    """Where a grid is described, for errors."""

    file: Path | str | None
    field: str

    def error(self, fault: str, got: object = None, hint: str | None = None) -> UserError:
        return UserError(fault, file=self.file, field=self.field, got=got, hint=hint)


@dataclass(frozen=True, eq=False)
class Grid:
    """Points at the centres of the cells of a parallelogram, facing `normal`.

    Attributes
    ----------
    corner, normal : (3,)
        World position, m, of the first cell's outer corner; unit direction that all points face.
    edges : (2, 3)
        Sides of the parallelogram, m: along the columns' numbers, along the rows'.
    inside : (rows, columns)
        Cells that belong to the grid; others lie beyond the outline of its object.
    """

    name: str
    corner: Floats
    edges: Floats
    normal: Floats
    inside: Flags

    @property
    def points(self) -> Floats:
        """World positions (n, 3), m, of the cells that are `inside`, row after row."""
        rows, columns = np.nonzero(self.inside)
        share = np.stack([(columns + 0.5) / self.inside.shape[1], (rows + 0.5) / self.inside.shape[0]], axis=1)
        return np.asarray(self.corner + share @ self.edges)

    @property
    def size_m(self) -> Floats:
        """(2,) lengths of the edges."""
        return np.asarray(np.linalg.norm(self.edges, axis=1))

    @property
    def cell_m(self) -> Floats:
        """(2,) sides of a cell."""
        return self.size_m / self.inside.shape[::-1]


def on_rectangle(
    name: str, corner: Floats, edges: Floats, place: Place, *, normal: Floats | None = None,
    spacing_m: float | None = None, margin_m: float = 0.0,
) -> Grid:  # fmt: skip
    """Grid on the parallelogram with sides `edges` (2, 3) from `corner` (3,), m, without a margin along its sides.

    The points face `normal`, or the side from which the second edge lies counter-clockwise of the first.

    Raises
    ------
    UserError
        If the area is zero, the margin leaves none, or there are too many points.
    """
    upright, size = np.cross(*edges), np.linalg.norm(edges, axis=1)
    if not np.linalg.norm(upright) > LEAST_AREA_M2:
        raise place.error("has no area", f"edges {np.round(edges, 6).tolist()}", "give two edges, not parallel")
    if 2 * margin_m >= size.min():
        raise place.error("margin leaves no area", f"{margin_m:g} m of {size.min():g} m", "choose a smaller margin")
    units = edges / size[:, None]
    corner, size = corner + margin_m * units.sum(axis=0), size - 2 * margin_m
    columns, rows = cells_of(size, spacing_m)
    GRID_POINTS.check(columns * rows, file=place.file, field=place.field, got=f"{columns:,} x {rows:,} points")
    facing = np.asarray(upright if normal is None else normal, float)
    inside = np.ones((rows, columns), bool)
    return Grid(name, corner, units * size[:, None], facing / np.linalg.norm(facing), inside)


def cells_of(size_m: Floats, spacing_m: float | None = None) -> tuple[int, int]:
    """Numbers of cells along both sides (2,): of `spacing_m` or about that, by default as in EN 12464-1."""
    long, short = max(map(float, size_m)), min(map(float, size_m))
    if spacing_m is None:
        d = short if long >= 2 * short else long
        p = min(0.2 * 5 ** math.log10(d), MOST_CELL_M)
        spacing_m = d / max(round(d / p), 1)
    first, second = (max(round(float(side) / spacing_m), 1) for side in size_m)
    return first, second


def on_object(
    name: str, corners: Floats, scene: Callable[[], Floats], place: Place, *, height_m: float = WORKPLANE_M,
    spacing_m: float | None = None, margin_m: float | None = None, normal: Floats | None = None,
) -> Grid:  # fmt: skip
    """Horizontal grid above the top of an object, or above the floor of a room, within its outline.

    Parameters
    ----------
    corners : (F, 3, 3)
        The object's triangles, m.
    scene : callable
        Gives the triangles of the whole scene, which tell a room's floor from its roof.
    margin_m : float, optional
        Distance of cells from the outline; by default the standard's band.

    Raises
    ------
    UserError
        If the object has no level top, or as in `on_rectangle`.
    """
    top = _top(corners, scene)
    if top is None:
        raise place.error("object has no level top", hint="give corner and edges instead")
    flat = np.stack([top[..., 0], -top[..., 2]], axis=-1)  # the plan: +x to the right, -z up
    low, axes, size = _around(flat.reshape(-1, 2))
    margin = min(BAND_M, BAND_SHARE * float(size.min())) if margin_m is None else margin_m
    edges = np.stack([axes[:, 0], np.zeros(2), -axes[:, 1]], axis=1) * size[:, None]
    corner = low @ axes
    origin = np.array([corner[0], float(top[..., 1].mean()) + height_m, -corner[1]])
    facing = np.array([0.0, 1.0, 0.0]) if normal is None else normal
    whole = on_rectangle(name, origin, edges, place, normal=facing, spacing_m=spacing_m, margin_m=margin)
    places = np.stack([whole.points[:, 0], -whole.points[:, 2]], axis=1) @ axes.T - low
    inside = _inside(flat @ axes.T - low, size, places, margin).reshape(whole.inside.shape)
    if not inside.any():
        raise place.error("margin leaves no area", f"{margin:g} m", "choose a smaller margin")
    return Grid(name, whole.corner, whole.edges, whole.normal, inside)


def _top(corners: Floats, scene: Callable[[], Floats]) -> Floats | None:
    """Triangles (K, 3, 3) of an object's main level that face up: the largest below a roof, the highest of equals."""
    vectors = area_vectors(corners)
    areas, steepest = np.linalg.norm(vectors, axis=1), math.cos(math.radians(FLAT_DEG))
    level = np.abs(vectors[:, 1]) > steepest * np.maximum(areas, 1e-30)
    up = level & (vectors[:, 1] > 0)
    chosen = np.flatnonzero(up if up.any() else level)  # a sheet may be modelled upside down
    if not len(chosen):
        return None
    heights = corners[chosen, :, 1].mean(axis=1)
    chosen, heights = chosen[np.argsort(heights)], np.sort(heights)
    levels = np.split(chosen, np.flatnonzero(np.diff(heights) > LEVEL_M) + 1)
    most = max(areas[one].sum() for one in levels)
    large = [one for one in levels if areas[one].sum() > LARGE * most]
    if len(large) == 1:
        return np.asarray(corners[large[0]])
    all_corners = scene()
    below = [_is_covered(corners[one[np.argmax(areas[one])]].mean(axis=0), all_corners) for one in large]
    best = max(range(len(large)), key=lambda k: (below[k], round(20 * areas[large[k]].sum() / most), k))
    return np.asarray(corners[large[best]])


def _is_covered(point: Floats, corners: Floats) -> bool:
    """Whether one of the triangles (F, 3, 3) lies above a point (3,)."""
    flat = corners[..., [0, 2]] - point[[0, 2]]
    parts = cross_2d(np.roll(flat, -1, axis=1), np.roll(flat, -2, axis=1))  # barycentric, times twice the area
    above = ((parts > 0).all(axis=1) | (parts < 0).all(axis=1)) & (corners[..., 1].max(axis=1) > point[1] + LEVEL_M)
    height = (parts[above] * corners[above, :, 1]).sum(axis=1) / parts[above].sum(axis=1)
    return bool((height > point[1] + LEVEL_M).any())


def _around(points: Floats) -> tuple[Floats, Floats, Floats]:
    """The smallest rectangle around plane points (N, 2): low corner (2,) in its axes, its unit axes (2, 2), size (2,).

    The first axis is the nearest to +x, and +x itself if that is as good.
    """
    from scipy.spatial import ConvexHull

    hull = points[ConvexHull(points).vertices]
    sides = np.roll(hull, -1, axis=0) - hull
    angles = np.append(0.0, (np.arctan2(sides[:, 1], sides[:, 0]) + np.pi / 4) % (np.pi / 2) - np.pi / 4)
    axes = np.stack([np.cos(angles), np.sin(angles), -np.sin(angles), np.cos(angles)], axis=1).reshape(-1, 2, 2)
    turned = np.einsum("kij,nj->kni", axes, hull)
    low, size = turned.min(axis=1), np.ptp(turned, axis=1)
    area = size.prod(axis=1)
    best = int(np.argmax(area <= area.min() * (1 + 1e-3)))
    return low[best], axes[best], size[best]


def _inside(triangles: Floats, size: Floats, points: Floats, margin_m: float) -> Flags:
    """Which points (N, 2) lie in triangles (K, 3, 2) within 0 to `size` (2,), `margin_m` away from their outline.

    The outline is exact to a cell of the raster; gaps between triangles that are narrower do not count.
    """
    from scipy.ndimage import binary_closing, distance_transform_edt

    from lambent.core.geometry.plan_cells import filled  # compiled, and needed only for grids on objects

    cell = float(size.max()) / RASTER
    columns, rows = (np.ceil(size / cell).astype(int) + 4).tolist()
    covered = binary_closing(filled(triangles / cell + 1.5, rows, columns), np.ones((3, 3)))
    column, row = np.floor(points / cell + 2).astype(int).T
    depth_m = distance_transform_edt(covered) * cell
    return np.asarray(covered[row, column] & (depth_m[row, column] > margin_m - 1.5 * cell))
