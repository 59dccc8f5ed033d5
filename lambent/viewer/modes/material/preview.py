"""The preview of a material: shapes, and the light around them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.camera import Camera
from lambent.core.colour import luminance
from lambent.core.cubemap import face_directions, texel_solid_angles
from lambent.core.directions import normalize
from lambent.core.errors import UserError
from lambent.core.images import read_image
from lambent.scenes.environments import daylight, dusk, from_lat_long, night, studio
from lambent.scenes.geometry import patch, placed, sphere, teapot, turn
from lambent.scenes.scene import Mesh
from lambent.viewer.mode import Divider

MEAN_RADIANCE = 0.35  # every environment is scaled to it, so that a change of light keeps the exposure
LAMP_TOWARDS, LAMP_RADIUS_DEG = (0.07, -0.08, -1.0), 6.0
LAMP_SHARE = 0.06  # of the environment's light
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
    """Which shape in which light."""

    shape: str = "sphere"
    environment: str = "studio"
    files: dict[str, Path] = field(default_factory=dict)  # environments of the user, by the name in the list
    divider: Divider = field(default_factory=Divider)

    @property
    def environments(self) -> tuple[str, ...]:
        return (*BUILT_IN, *self.files)

    def add(self, path: Path) -> str:
        """List an environment; its name there."""
        name = path.stem
        while name in BUILT_IN or (name in self.files and self.files[name] != path):
            name = f"{name}'"
        self.files[name] = path
        return name

    def choose(self, path: Path) -> None:
        """List an environment and light the shape with it."""
        self.environment = self.add(path)

    def light(self, name: str) -> Floats:
        """The environment (6, n, n, 3) of that name, scaled to `MEAN_RADIANCE`; `UserError` where it is none."""
        if name in BUILT_IN:
            cube = BUILT_IN[name]()
        else:
            picture = read_image(self.files[name])
            height, width = picture.shape[:2]
            if width != 2 * height:
                got = f"{width}x{height}"
                raise UserError("not a lat-long picture", file=self.files[name], got=got, expected="2:1")
            cube = from_lat_long(picture[..., :3])
        cube = np.maximum(np.nan_to_num(cube, posinf=0.0, neginf=0.0), 0)
        mean = _mean_radiance(cube)
        if mean <= 0:
            raise UserError("the environment is black", file=self.files.get(name))
        return np.asarray(cube * (MEAN_RADIANCE / mean), np.float32)


def with_lamp(cube: Floats) -> Floats:
    """The environment with a round lamp far behind the sheet, which adds `LAMP_SHARE` of the light."""
    w = normalize(face_directions(cube.shape[1]))
    cosine = np.cos(np.radians(LAMP_RADIUS_DEG))
    edge = 2 / cube.shape[1]  # a texel's angle: the rim is as soft as the cube is coarse
    away = np.arccos(np.clip(w @ normalize(np.array(LAMP_TOWARDS)), -1, 1))
    inside = np.clip((np.radians(LAMP_RADIUS_DEG) - away) / edge + 0.5, 0, 1)[..., None]
    radiance = LAMP_SHARE * 4 * np.pi * _mean_radiance(cube) / (2 * np.pi * (1 - cosine))
    return np.asarray(cube + inside * (radiance - cube), np.float32)


def _mean_radiance(cube: Floats) -> float:
    return float((luminance(cube) * texel_solid_angles(cube.shape[1])).sum() / (4 * np.pi))
