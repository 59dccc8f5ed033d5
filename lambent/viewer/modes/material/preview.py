"""The preview of a material: shapes, and the light around them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.geometry.cubemap import face_directions, texel_solid_angles
from lambent.core.geometry.directions import normalize
from lambent.core.light.colour import luminance
from lambent.core.views.camera import Camera
from lambent.scenes.geometry import patch, placed, sphere, teapot, turn
from lambent.scenes.scene import Mesh
from lambent.scenes.sky.environment_images import read_lat_long
from lambent.scenes.sky.environments import daylight, dusk, from_lat_long, night, studio
from lambent.viewer.mode import Divider

MEAN_RADIANCE = 0.35  # all environments are scaled to this mean, so that they share an exposure
LAMP_TOWARDS, LAMP_RADIUS_DEG = (0.07, -0.08, -1.0), 6.0
LAMP_SHARE = 0.06  # light of the lamp, relative to the environment's
OBJECT = "preview"
BOUNDS = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
CAMERA = Camera(name="front", position=(0.0, 0.75, 4.1), target=(0.0, 0.0, 0.0), fov_y_deg=32.0)

BUILT_IN = {make.__name__: make for make in (studio, daylight, dusk, night)}


def _sheet() -> Mesh:
    tilted = turn("x", -28.0) @ turn("y", 20.0)
    return placed(patch((-0.8, -0.8, 0), (1.6, 0, 0), (0, 1.6, 0)), rotation=tilted)


SHAPES: dict[str, Callable[[], Mesh]] = {
    "sphere": lambda: sphere(0.95, around=64, rows=32),
    "teapot": lambda: placed(teapot(2.1, steps=8), (0.0, -0.5, 0.0)),
    "sheet": _sheet,
    "sheet before a lamp": _sheet,
}


@dataclass
class Preview:
    """Shape and environment of the preview."""

    shape: str = "sphere"
    environment: str = "studio"
    files: dict[str, Path] = field(default_factory=dict)  # the user's environments, by listed name
    divider: Divider = field(default_factory=Divider)

    @property
    def environments(self) -> tuple[str, ...]:
        return (*BUILT_IN, *self.files)

    def add(self, path: Path) -> str:
        """Add an environment to the list, and return its listed name."""
        name = path.stem
        while name in BUILT_IN or (name in self.files and self.files[name] != path):
            name = f"{name}'"
        self.files[name] = path
        return name

    def choose(self, path: Path) -> None:
        """Add an environment to the list and use it."""
        self.environment = self.add(path)

    def light(self, name: str) -> Floats:
        """Cube map (6, n, n, 3) of an environment, scaled to `MEAN_RADIANCE`; may raise `UserError`."""
        if name in BUILT_IN:
            cube = BUILT_IN[name]()
        else:
            picture = read_lat_long(self.files[name])
            height, width = picture.shape[:2]
            if width != 2 * height:
                got = f"{width}x{height}"
                what = "is no lat-long picture, angular map, cross or strip"
                raise UserError(what, file=self.files[name], got=got, expected="2:1")
            cube = from_lat_long(picture)
        cube = np.maximum(np.nan_to_num(cube, posinf=0.0, neginf=0.0), 0)
        mean = _mean_radiance(cube)
        if mean <= 0:
            raise UserError("the environment is black", file=self.files.get(name))
        return np.asarray(cube * (MEAN_RADIANCE / mean), np.float32)


def with_lamp(cube: Floats) -> Floats:
    """The environment with a round lamp far behind the sheet, which adds `LAMP_SHARE` of the light."""
    w = normalize(face_directions(cube.shape[1]))
    cosine = np.cos(np.radians(LAMP_RADIUS_DEG))
    edge = 2 / cube.shape[1]  # one texel: the rim is as soft as the cube map's resolution
    away = np.arccos(np.clip(w @ normalize(np.array(LAMP_TOWARDS)), -1, 1))
    inside = np.clip((np.radians(LAMP_RADIUS_DEG) - away) / edge + 0.5, 0, 1)[..., None]
    radiance = LAMP_SHARE * 4 * np.pi * _mean_radiance(cube) / (2 * np.pi * (1 - cosine))
    return np.asarray(cube + inside * (radiance - cube), np.float32)


def _mean_radiance(cube: Floats) -> float:
    return float((luminance(cube) * texel_solid_angles(cube.shape[1])).sum() / (4 * np.pi))
