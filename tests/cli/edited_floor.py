"""A floor of paint over one of chrome, for commands that edit views; and sessions that edit the paint."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lambent.core.plain import triple
from lambent.editing.session.session import Session
from lambent.materials.document import Material
from lambent.scenes.loaders.load import load_scene

SIZE = (24, 16)
SCENE = """
format = "lambent-scene"
version = 1
name = "floor"
geometry = "floor.obj"
exposure_ev = 1.0
[environment]
kind = "constant"
radiance = [1.0, 1.0, 1.0]
[materials.paint]
kd = 0.5
[materials.chrome]
lobes = [{ mx = 0.3, my = 0.3 }]
[[cameras]]
name = "above"
position = [0.0, 2.0, 1.0]
target = [0.0, 0.0, 0.0]
fov_y_deg = 30.0
"""
FLOOR = """
v -9 0 -9
v -9 0 9
v 9 0 9
v 9 0 -9
v -9 -1 -9
v -9 -1 9
v 9 -1 9
usemtl paint
o floor
f 1 2 3 4
usemtl chrome
o below
f 5 6 7
"""


def write_floor(folder: Path) -> Path:
    (folder / "floor.obj").write_text(FLOOR)
    (folder / "scene.toml").write_text(SCENE)
    return folder / "scene.toml"


def saved(scene: Path, name: str, start: Material | None = None, **changes: object) -> Path:
    """A session of the floor's paint, half of it in blue."""
    loaded = load_scene(str(scene))
    paint = start or loaded.materials["paint"]
    session = Session.new("s", loaded.cameras[0], {"paint": paint}, size=SIZE, **changes)  # type: ignore[arg-type]
    session.change("paint", paint.model_copy(update={"kd": triple(np.multiply(paint.kd, (1.0, 1.0, 0.5)))}))
    session.save(scene.parent / name)
    return scene.parent / name
