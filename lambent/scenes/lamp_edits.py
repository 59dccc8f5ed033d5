"""Edits of a scene's lamps: where they are, where they aim, and whose light they give."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from lambent.core.errors import UserError
from lambent.core.geometry.directions import normalize
from lambent.core.light.colour import luminance
from lambent.core.light.photometry import LM_PER_W
from lambent.core.plain import Triple, triple
from lambent.scenes.photometry.distribution import Photometry
from lambent.scenes.photometry.files import read_luminaire
from lambent.scenes.photometry.luminous_surfaces import placement, shining
from lambent.scenes.photometry.opening import POINT
from lambent.scenes.scene import IesLight, PointLight, Scene

DOWN: Triple = (0.0, -1.0, 0.0)


@dataclass(frozen=True)
class LampEdit:
    """A lamp at a `position`, m, with its axis along `aim`, rotated about that as `IesLight` is.

    `file` is the path of the IES or EULUMDAT file that it has from now on, with the flux of the file and the colour of
    the lamp; empty: it keeps its light.
    """

    position: Triple
    aim: Triple = DOWN
    rotation_deg: float = 0.0
    file: str = ""

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 - read by pydantic: an unknown key in a file is an error

    def __post_init__(self) -> None:
        numbers = (*self.position, *self.aim, self.rotation_deg)
        if not np.isfinite(numbers).all() or not any(self.aim):
            raise ValueError("a lamp needs finite numbers, and an aim that is not zero")

    @property
    def axis(self) -> Triple:
        """The aim at unit length."""
        return triple(normalize(np.array(self.aim, float)))


def edited_lamp(lamp: PointLight | IesLight, edit: LampEdit) -> PointLight | IesLight:
    """A lamp after an edit, with the same opening; `UserError` if its file cannot be read."""
    if edit.file:
        found = exchanged(edit, lamp.intensity if isinstance(lamp, PointLight) else lamp.scale, lamp.name)
        opening = POINT if isinstance(lamp, PointLight) else lamp.photometry.opening
        return replace(found, photometry=replace(found.photometry, opening=opening))
    if isinstance(lamp, IesLight):
        now, before = (lamp.photometry.tilted(tilt_deg(aim)) for aim in (edit.axis, lamp.aim))
        scale = triple(np.array(lamp.scale) * (now / before if before else 1.0))
        return replace(lamp, position=edit.position, aim=edit.axis, rotation_deg=edit.rotation_deg, scale=scale)
    return replace(lamp, position=edit.position, direction=None if lamp.direction is None else edit.axis)


def exchanged(edit: LampEdit, colour: Triple, name: str = "") -> IesLight:
    """The luminaire of an edit's file in a `colour`, whose luminance has no effect; `UserError` if it is unreadable."""
    photometry = photometry_of(Path(edit.file))
    tint = np.array(colour if any(colour) else (1.0, 1.0, 1.0))
    scale = triple(tint * photometry.tilted(tilt_deg(edit.axis)) / LM_PER_W / float(luminance(tint)))
    return IesLight(edit.position, photometry, scale, edit.axis, edit.rotation_deg, name=name)


def photometry_of(path: Path) -> Photometry:
    """The photometry of a file with its first lamp set, read again if it changes; `UserError` if that fails."""
    return _read(path, path.stat().st_mtime_ns if path.is_file() else 0)


@lru_cache(16)
def _read(path: Path, changed_ns: int) -> Photometry:
    return read_luminaire(path).photometry()


def tilt_deg(aim: Triple) -> float:
    """Angle between a unit axis and straight down."""
    return float(np.degrees(np.arccos(np.clip(-aim[1], -1.0, 1.0))))


def with_lamp_edits(scene: Scene, edits: Mapping[int, LampEdit]) -> Scene:
    """The scene with edited lamps, by their place among its lights; their openings keep their meshes, but `moved`.

    Raises
    ------
    UserError
        If a light is not a lamp at a point, or a file cannot be read.
    """
    lights, objects = list(scene.lights), {o.luminaire: o for o in scene.objects if o.luminaire is not None}
    for number, edit in edits.items():
        lamp = lights[number] if 0 <= number < len(lights) else None
        if not isinstance(lamp, PointLight | IesLight):
            raise UserError("the scene has no such lamp", field="lamps", got=number, hint="reset the edited lamps")
        lights[number] = now = edited_lamp(lamp, edit)
        if isinstance(lamp, IesLight) and isinstance(now, IesLight) and number in objects:
            before = placement(lamp.axes, lamp.position)
            moved = placement(now.axes, now.position) @ np.linalg.inv(before)
            objects[number] = shining(replace(objects[number], moved=tuple(map(tuple, moved.tolist()))), now)
    of_scene = tuple(o if o.luminaire is None else objects[o.luminaire] for o in scene.objects)
    return replace(scene, lights=tuple(lights), objects=of_scene)
