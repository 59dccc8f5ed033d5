"""Calculation surfaces as a scene.toml or a command line describes them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from lambent.core.ceilings import GRID_POINTS
from lambent.core.errors import UserError
from lambent.scenes.grids import BAND_M, BAND_SHARE, WORKPLANE_M, Grid, cells_of, top_of, within
from lambent.scenes.loaders.scene_toml.assembly import fitting
from lambent.scenes.loaders.scene_toml.sections import Near, NotNegative, Place, Section, not_zero
from lambent.scenes.mesh import corners_of
from lambent.scenes.scene import SceneObject

PLAN = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])  # axes of the plan: +x to the right, -z up
UP = np.array([0.0, 1.0, 0.0])


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

    def grid(self, objects: Sequence[SceneObject], path: Path | None, field: str = "grids") -> Grid:
        """The grid in a scene of these objects; `UserError` if it has no points, or too many."""
        place: dict[str, Any] = {"file": path, "field": f"{field}.{self.name}" if path else field}
        if self.object is not None:
            return self._on_object(objects, place)
        edges = np.array(self.edges, float)
        corner = np.array(self.corner) if self.corner is not None else np.array(self.centre) - edges.sum(axis=0) / 2
        return self._on_rectangle(corner + UP * (self.height_m or 0.0), edges, self.margin_m or 0.0, place)

    def _on_rectangle(self, corner: Any, edges: Any, margin_m: float, place: dict[str, Any]) -> Grid:
        upright, size = np.cross(*edges), np.linalg.norm(edges, axis=1)
        if not np.linalg.norm(upright) > 1e-6 * max(size.max() ** 2, 1e-6):
            raise UserError("has no area", got=edges.tolist(), expected="two edges that are not parallel, m", **place)
        if 2 * margin_m >= size.min():
            hint = "choose a smaller margin, or name all parts of a surface with *"
            raise UserError(f"a margin of {margin_m:g} m leaves nothing of {size.min():g} m", hint=hint, **place)
        units, size = edges / size[:, None], size - 2 * margin_m
        columns, rows = cells_of(size, self.spacing_m)
        GRID_POINTS.check(columns * rows, got=f"{columns:,} x {rows:,} points", **place)
        facing = np.array(self.normal or upright, float) / np.linalg.norm(self.normal or upright)
        corner, inside = corner + margin_m * units.sum(axis=0), np.ones((rows, columns), bool)
        return Grid(self.name, corner, units * size[:, None], facing, inside)

    def _on_object(self, objects: Sequence[SceneObject], place: dict[str, Any]) -> Grid:
        names = set(fitting(str(self.object), [o.name for o in objects], place["file"], place["field"], self.object))
        top = top_of(corners_of([o.mesh for o in objects if o.name in names]))
        if not len(top):
            raise UserError("object has no level top", got=self.object, hint="give corner and edges", **place)
        outline = top @ PLAN.T
        low, size = outline.min(axis=(0, 1)), np.ptp(outline, axis=(0, 1))
        margin_m = min(BAND_M, BAND_SHARE * float(size.min())) if self.margin_m is None else self.margin_m
        level = float(top[..., 1].mean()) + (WORKPLANE_M if self.height_m is None else self.height_m)
        grid = self._on_rectangle(low @ PLAN + UP * level, size[:, None] * PLAN, margin_m, place)
        inside = within(outline, grid.points @ PLAN.T, margin_m).reshape(grid.inside.shape)
        if not inside.any():
            raise UserError(f"a margin of {margin_m:g} m leaves nothing", hint="choose a smaller margin", **place)
        return Grid(self.name, grid.corner, grid.edges, grid.normal, inside)
