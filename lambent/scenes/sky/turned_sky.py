"""A scene under its sky rotated about the vertical, suns included: the reference for relit light fields."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from lambent.core.errors import UserError
from lambent.core.pictures.images import write_image
from lambent.core.plain import triple
from lambent.scenes.geometry import turn
from lambent.scenes.scene import ComputedEnvironment, DirectionalLight, Environment, ImageEnvironment, Scene, SunSky
from lambent.scenes.sky.computed import lat_long_image

VERTICAL = "+y"


def under_turned_sky(scene: Scene, degrees: float, folder: Path) -> Scene:
    """The scene with its environment and distant lights rotated by `degrees` from -z towards -x.

    Procedural surroundings are written to an image in `folder`, which must outlive the scene.

    Raises
    ------
    UserError
        If the environment is an image whose own up is not the vertical.
    """
    if degrees % 360 == 0:
        return scene
    rotation = turn("y", degrees)
    lights = (
        replace(light, direction=triple(rotation @ np.array(light.direction)))
        if isinstance(light, DirectionalLight)
        else light
        for light in scene.lights
    )
    return replace(scene, lights=tuple(lights), environment=_turned(scene.environment, degrees, folder))


def _turned(environment: Environment | None, degrees: float, folder: Path) -> Environment | None:
    if isinstance(environment, SunSky):
        return replace(environment, sun_direction=triple(turn("y", degrees) @ np.array(environment.sun_direction)))
    if isinstance(environment, ComputedEnvironment):
        file = folder / f"{environment.name}.exr"
        write_image(file, lat_long_image(environment.name))
        environment = ImageEnvironment(file, layout="lat-long")
    if isinstance(environment, ImageEnvironment):
        if environment.up != VERTICAL:
            said = f"an image with up = {VERTICAL}"
            raise UserError(
                "sky image is not upright and cannot be rotated", field="--sky-turn", got=environment.up, expected=said
            )
        return replace(environment, rotation_deg=environment.rotation_deg + degrees)
    return environment
