"""Calculation surfaces of a scene.toml: `scenes.grids` on rectangles, and on objects by name."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, field_validator, model_validator

from lambent.scenes.grids import WORKPLANE_M, Grid, Place, on_object, on_rectangle
from lambent.scenes.loaders.scene_toml.assembly import fitting
from lambent.scenes.loaders.scene_toml.sections import Near, NotNegative, Section, Vector, not_zero
from lambent.scenes.loaders.scene_toml.sections import Place as Position
from lambent.scenes.mesh import corners_of
from lambent.scenes.scene import SceneObject


class GridSection(Section):
    """A rectangle by its `corner` or `centre` and two `edges`, or an `object` (a pattern); `height_m` lies above it."""

    name: Annotated[str, Field(min_length=1, max_length=80)]
    object: str | None = None
    corner: Position | None = None
    centre: Position | None = None
    edges: tuple[Position, Position] | None = None
    height_m: Near | None = None
    spacing_m: Annotated[float, Field(ge=1e-3, allow_inf_nan=False)] | None = None
    margin_m: NotNegative | None = None
    normal: Vector | None = None

    _normal = field_validator("normal")(lambda vector: None if vector is None else not_zero(vector))

    @model_validator(mode="after")
    def _one_place(self) -> GridSection:
        given = [key for key in ("object", "corner", "centre") if getattr(self, key) is not None]
        if len(given) != 1:
            raise ValueError(f"has {' and '.join(given) or 'no place'}: set one of object, corner, centre")
        if (self.edges is None) != (self.object is not None):
            raise ValueError("edges belong to a corner or a centre: two vectors in metres")
        return self

    def grid(self, objects: Sequence[SceneObject], path: Path) -> Grid:
        """The grid in a scene of these objects; `UserError` if it has no points, or too many."""
        place = Place(path, f"grids.{self.name}")
        normal = None if self.normal is None else np.array(self.normal)
        if self.object is not None:
            names = fitting(self.object, [o.name for o in objects], path, f"{place.field}.object", got=self.object)
            own = corners_of([o.mesh for o in objects if o.name in names])
            return on_object(
                self.name, own, lambda: corners_of([o.mesh for o in objects]), place,
                height_m=WORKPLANE_M if self.height_m is None else self.height_m, spacing_m=self.spacing_m,
                margin_m=self.margin_m, normal=normal,
            )  # fmt: skip
        edges = np.array(self.edges, float)
        corner = np.array(self.corner) if self.corner is not None else np.array(self.centre) - edges.sum(axis=0) / 2
        return on_rectangle(
            self.name, corner + (0.0, self.height_m or 0.0, 0.0), edges, place, normal=normal,
            spacing_m=self.spacing_m, margin_m=self.margin_m or 0.0,
        )  # fmt: skip
