"""Light fields in the window: the points of the selected object, and the map of a picked point."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np

from lambent.baked.light_fields.light_field import LightField
from lambent.core.arrays import Floats
from lambent.core.light.colour import shown
from lambent.core.light.false_colour import ramp
from lambent.core.pictures.images import to_bytes
from lambent.core.views.camera import Camera
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.cube_mips import finite
from lambent.realtime.overlays.discs import Discs
from lambent.viewer.mode import Image
from lambent.viewer.modes.walk.markers import NEAR_M, Size, projected

Shows = Literal["light", "distance"]
SHOWS: tuple[Shows, ...] = get_args(Shows)
DISC_PX, PICKED_PX = 3.5, 6.0  # radii in logical pixels
REACH_PX = 8.0  # largest distance of a click from a disc's middle
HIDDEN = 1.02  # points farther than this times the clicked surface are hidden
CHOICE = "light_field-choice"  # the look-up that shows the used points
HUES = np.array([0.618034, 0.754878, 0.569840])  # as in the shader of `CHOICE`


@dataclass
class FieldView:
    """Shown parts of a light field: its points, and the map of the picked `point`."""

    fields: Mapping[str, LightField] = field(default_factory=dict)  # by object
    points_on: bool = False
    map_on: bool = False
    shows: Shows = "light"
    point: int = 0
    owner: str | None = None  # the object whose light field is shown

    def follow(self, names: Collection[str]) -> None:
        """Show the light field of the first of the selected `names` that has one."""
        owner = next((name for name in sorted(names) if name in self.fields), None)
        if owner != self.owner:
            self.owner, self.point = owner, 0

    @property
    def chosen(self) -> LightField | None:
        return None if self.owner is None else self.fields[self.owner]

    def pick(self, camera: Camera, at: tuple[float, float], size: Size, distance_m: float) -> bool:
        """Pick the point within reach of `at`, in pixels of a picture of `size`; return whether there is one.

        The clicked surface at `distance_m` hides points behind it.
        """
        light_field = self.chosen
        if light_field is None or not self.points_on:
            return False
        places, depths_m = projected(camera, light_field.points.astype(float), size)
        away_px = np.linalg.norm(places * np.array(size) - at, axis=-1)
        away_m = np.linalg.norm(light_field.points - np.array(camera.position), axis=-1)
        can_be = (depths_m > NEAR_M) & (away_m <= HIDDEN * distance_m) & (away_px <= REACH_PX)
        if not can_be.any():
            return False
        self.point, self.map_on = int(np.argmin(np.where(can_be, away_px, np.inf))), True
        return True


class FieldDrawing:
    """`images` has the discs ("points") and the map ("map") of a view, drawn again after changes."""

    def __init__(self, discs: Discs, view: FieldView) -> None:
        self._discs, self._view = discs, view
        self._points_of: tuple[Any, ...] = ()
        self._map_of: tuple[Any, ...] = ()
        self.images: dict[str, Any] = {}

    def update(self, frame: FrameState, transform: str, exposure_ev: float, pixel_ratio: float) -> None:
        """Update for the picture of `frame`; `exposure_ev` is relative to the maps' unit."""
        view, light_field = self._view, self._view.chosen
        points_of = (view.points_on, view.owner, view.point, frame.camera, frame.size, frame.near_m, pixel_ratio)
        if points_of != self._points_of:
            self._points_of = points_of
            self.images.pop("points", None)
            if view.points_on and light_field is not None:
                self.images["points"] = self._drawn(frame, light_field, pixel_ratio)
        map_of = (view.map_on, view.owner, view.point, view.shows, transform, exposure_ev)
        if map_of != self._map_of:
            self._map_of = map_of
            self.images.pop("map", None)
            if view.map_on and light_field is not None:
                self.images["map"] = map_image(light_field, view.point, view.shows, transform, exposure_ev)

    def _drawn(self, frame: FrameState, light_field: LightField, pixel_ratio: float) -> Any:
        numbers = np.arange(len(light_field.points), dtype=float)
        picked = numbers == self._view.point
        radii = np.where(picked, PICKED_PX, DISC_PX) * pixel_ratio
        return self._discs.draw(frame, light_field.points, colours_of(numbers), radii, np.where(picked, 1.0, 0.0))


def shows_choice(frame: FrameState) -> bool:
    """Whether an object shows the used points in their colours."""
    return CHOICE in (frame.lookup, *frame.lookups.values())


def colours_of(numbers: Floats) -> Floats:
    """Colour (P, 3) in [.2, .8] of each point, with the same hue as in `light_field-choice`."""
    return np.asarray(0.2 + 0.6 * np.modf(numbers[:, None] * HUES)[0])


def map_image(light_field: LightField, point: int, shows: Shows, transform: str, exposure_ev: float) -> Image:
    """RGBA (E, E, 4) of a point's map: its light, or log distances with a black sky."""
    if shows == "light":
        light = finite(light_field.radiance[point])[0]
        rgb = shown(np.asarray(light, np.float32), transform, exposure_ev)
    else:
        inverse = np.asarray(light_field.inverse_distance[point], np.float64)
        hit = np.isfinite(inverse) & (inverse > 0)
        far, near = distances_m(light_field, point)
        share = np.log(np.where(hit, inverse, 1 / far) * far) / max(np.log(far / near), 1e-6)
        rgb = np.where(hit[..., None], ramp(share), 0.0)
    rgba = np.full((*rgb.shape[:2], 4), 255, np.uint8)
    rgba[..., :3] = to_bytes(rgb)
    return rgba


def distances_m(light_field: LightField, point: int) -> tuple[float, float]:
    """The largest and the smallest distance, m, in a point's map; 1, 1 if it sees only the sky."""
    inverse = np.asarray(light_field.inverse_distance[point], np.float64)
    hits = inverse[np.isfinite(inverse) & (inverse > 0)]
    return (float(1 / hits.min()), float(1 / hits.max())) if len(hits) else (1.0, 1.0)
