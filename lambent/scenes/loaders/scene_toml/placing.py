"""A geometry file's contents in the scene: in metres, with y up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.plain import Triple, triple
from lambent.core.surroundings import Axis
from lambent.scenes.geometry import transformed
from lambent.scenes.loaders.contents import Contents
from lambent.scenes.loaders.meshes.repair import ABSURD
from lambent.scenes.scene import DirectionalLight, IesLight, Light
from lambent.scenes.sky.environment_images import up_turn


def placed(contents: Contents, scale: float, up: Axis, path: Path) -> Contents:
    """Contents scaled by `scale` about the origin and rotated so that their axis `up` becomes +y; not the environment.

    Raises
    ------
    UserError
        If the scale is out of range, or objects become too large.
    """
    if scale == 1 and up == "+y":
        return contents
    if not 1e-9 <= scale <= 1e9 or max(np.abs(o.mesh.positions).max() for o in contents.objects) * scale > ABSURD:
        raise UserError("scale is too large", file=path, field="geometry.scale", got=scale)
    turn = up_turn(up).T
    matrix = np.eye(4)
    matrix[:3, :3] = scale * turn

    def at(position: Triple) -> Triple:
        return triple(matrix[:3, :3] @ position)

    return replace(
        contents,
        objects=tuple(replace(o, mesh=transformed(o.mesh, matrix)) for o in contents.objects),
        cameras=tuple(
            replace(c, position=at(c.position), target=at(c.target), up=triple(turn @ c.up)) for c in contents.cameras
        ),
        lights=tuple(_placed_light(light, scale, turn) for light in contents.lights),
    )


def _placed_light(light: Light, scale: float, turn: Floats) -> Light:
    if isinstance(light, DirectionalLight):
        return replace(light, direction=triple(turn @ light.direction))
    position = triple(scale * turn @ light.position)
    if isinstance(light, IesLight):
        across = turn @ light.axes[0]
        return replace(light, position=position, aim=triple(turn @ light.aim)).turned_to(across)
    direction = None if light.direction is None else triple(turn @ light.direction)
    return replace(light, position=position, direction=direction)
