"""Calculation surfaces as a scene.toml or a command line describes them; cells and band by EN 12464-1 (2011), 4.4."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from lambent.core.arrays import Flags, Floats
from lambent.core.ceilings import GRID_POINTS
from lambent.core.errors import UserError
from lambent.core.geometry.triangles import area_vectors
from lambent.scenes.grids import Grid
from lambent.scenes.loaders.scene_toml.assembly import fitting
from lambent.scenes.loaders.scene_toml.sections import Near, NotNegative, Place, Section, not_zero
from lambent.scenes.mesh import corners_of
from lambent.scenes.scene import SceneObject

BAND_M, BAND_SHARE = 0.5, 0.15  # left out along the outline of an object, and at most, of its shorter side
WORKPLANE_M = 0.75  # height above a floor
MOST_CELL_M = 10.0
LEVEL_COS, LEVEL_M = 0.985, 0.01  # of a top: slope of its triangles, and difference in height from one to the next
AS_LARGE = 0.8  # share of the largest level's area from which another counts as as large
RASTER = 1024  # cells along the longer side of an outline
PLAN, UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]), np.array([0.0, 1.0, 0.0])  # to the right, and up in the plan


class GridSection(Section):
    """A rectangle by `corner` or `centre` and two `edges`, or the top of an `object` (a pattern); `height_m` above it.

    Without a normal, points face up above an object, else along edges[0] x edges[1].
    """

    name: Annotated[str, Field(min_length=1, max_length=80)]
    object: str | None = None
    corner: Place | None = None
    centre: Place | None = None
    edges: tuple[Place, Place] | None = None
    height_m: Near | None = None
    spacing_m: Annotated[float, Field(ge=1e-3, allow_inf_nan=False)] | None = None
    margin_m: NotNegative | None = None
    normal: Place | None = None

    @model_validator(mode="after")
    def _one_place(self) -> GridSection:
        given = [key for key in ("object", "corner", "centre") if getattr(self, key) is not None]
        if len(given) != 1 or (self.edges is None) != (given == ["object"]):
            raise ValueError("must have one of object, corner and edges, or centre and edges")
        not_zero(self.normal or (0.0, 1.0, 0.0))
        return self

    def grid(self, objects: Sequence[SceneObject], path: Path | None, field: str) -> Grid:
        """The grid in a scene of these objects; `UserError` if it has no points, or too many."""
        place: dict[str, Any] = {"file": path, "field": field}
        if self.object is None:
            edges, start = np.array(self.edges), np.array(self.corner or self.centre)
            corner = start - (edges.sum(axis=0) / 2 if self.corner is None else 0) + UP * (self.height_m or 0.0)
            return self._on_rectangle(corner, edges, self.margin_m or 0.0, place)
        names = fitting(self.object, [o.name for o in objects], place["file"], field, self.object)
        top = _top(corners_of([o.mesh for o in objects if o.name in names]))
        if not len(top):
            raise UserError("object has no level top", got=self.object, hint="give corner and edges", **place)
        outline = top @ PLAN.T
        low, size = outline.min(axis=(0, 1)), np.ptp(outline, axis=(0, 1))
        margin_m = min(BAND_M, BAND_SHARE * float(size.min())) if self.margin_m is None else self.margin_m
        level = float(top[..., 1].max()) + (WORKPLANE_M if self.height_m is None else self.height_m)
        grid = self._on_rectangle(low @ PLAN + UP * level, size[:, None] * PLAN, margin_m, place)
        inside = _within(outline - low, grid.points @ PLAN.T - low, margin_m).reshape(grid.inside.shape)
        if not inside.any():
            raise UserError(f"a margin of {margin_m:g} m leaves nothing", hint="choose a smaller margin", **place)
        return replace(grid, inside=inside)

    def _on_rectangle(self, corner: Floats, edges: Floats, margin_m: float, place: dict[str, Any]) -> Grid:
        facing, size = np.cross(*edges), np.linalg.norm(edges, axis=1)
        if not np.linalg.norm(facing) > 1e-6 * max(size.max() ** 2, 1e-6):
            raise UserError("has no area", got=edges.tolist(), expected="two edges that are not parallel, m", **place)
        if 2 * margin_m >= size.min():
            hint = "choose a smaller margin, or name all parts of a surface with *"
            raise UserError(f"a margin of {margin_m:g} m leaves nothing of {size.min():g} m", hint=hint, **place)
        facing = facing if self.normal is None else np.array(self.normal)
        units, size = edges / size[:, None], size - 2 * margin_m
        columns, rows = cells_of(size, self.spacing_m)
        GRID_POINTS.check(columns * rows, got=f"{columns:,} x {rows:,} points", **place)
        corner, facing = corner + margin_m * units.sum(axis=0), facing / np.linalg.norm(facing)
        return Grid(self.name, corner, units * size[:, None], facing, np.ones((rows, columns), bool))


def cells_of(size_m: Floats, spacing_m: float | None = None) -> tuple[int, int]:
    """Cells along both sides (2,), m, of about `spacing_m`; by default, the standard's .2 m 5^(log10 d).

    d is the longer side, or the shorter one if the longer is at least twice as long.
    """
    short, long = sorted(map(float, size_m))
    d = short if long >= 2 * short else long
    spacing_m = spacing_m or d / max(round(d / min(0.2 * 5 ** math.log10(d), MOST_CELL_M)), 1)
    columns, rows = (max(round(float(side) / spacing_m), 1) for side in size_m)
    return columns, rows


def _top(corners: Floats) -> Floats:
    """The largest level (K, 3, 3) of triangles (F, 3, 3) that face up; of equals the lowest: a floor, not a roof."""
    vectors = area_vectors(corners)
    areas, heights = np.linalg.norm(vectors, axis=1), corners[..., 1].mean(axis=1)
    level = np.abs(vectors[:, 1]) > LEVEL_COS * areas
    up = level & (vectors[:, 1] > 0)
    chosen = np.flatnonzero(up if up.any() else level)  # a sheet may be modelled upside down
    chosen = chosen[np.argsort(heights[chosen], kind="stable")]
    levels = np.split(chosen, np.flatnonzero(np.diff(heights[chosen]) > LEVEL_M) + 1)
    most = max(areas[one].sum() for one in levels)
    return np.asarray(corners[next(one for one in levels if areas[one].sum() >= AS_LARGE * most)])


def _within(outline: Floats, points: Floats, margin_m: float) -> Flags:
    """Whether plane points (N, 2) lie in triangles (K, 3, 2) from (0, 0) on, `margin_m` away from their outline.

    Both are exact to a cell of the raster; gaps between triangles that are narrower do not count.
    """
    from scipy.ndimage import binary_closing, distance_transform_edt

    from lambent.core.geometry.plan_cells import filled  # compiled, and needed only for grids on objects

    cell_m = float(outline.max()) / RASTER
    columns, rows = (outline.max(axis=(0, 1)) / cell_m).astype(int) + 5
    covered = binary_closing(filled(outline / cell_m + 1.5, rows, columns), np.ones((3, 3)))
    column, row = np.floor(points / cell_m + 2).astype(int).T
    return np.asarray(distance_transform_edt(covered)[row, column] * cell_m > max(margin_m - 1.5 * cell_m, 0))
