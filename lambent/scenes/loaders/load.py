"""`load_scene`: one door for every scene."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

from lambent.core.errors import UserError, did_you_mean
from lambent.core.files import inside
from lambent.scenes.builtin.box import box
from lambent.scenes.builtin.room import room
from lambent.scenes.loaders.parts import Parts
from lambent.scenes.loaders.toml import load_toml
from lambent.scenes.scene import Scene, SceneObject

BUILTIN_PREFIX = "builtin:"
BUILTIN: dict[str, Callable[[], list[SceneObject]]] = {"room": room, "box": box}
READERS: dict[str, Callable[[Path], Parts]] = {}


def load_scene(path_or_builtin: str | Path) -> Scene:
    """The scene of a file, or a built-in one.

    Parameters
    ----------
    path_or_builtin : str or Path
        "builtin:room", "builtin:box", or the path of a scene.toml.

    Raises
    ------
    UserError
        Where there is no such scene, or its file cannot be used.
    """
    text = str(path_or_builtin)
    if text.startswith(BUILTIN_PREFIX):
        name = text.removeprefix(BUILTIN_PREFIX)
        _builtin(name)  # raises the error of an unknown name
        return load_toml(Path(str(files("lambent.scenes.builtin") / f"{name}.toml")), read_geometry)
    path = Path(path_or_builtin)
    if path.suffix.lower() == ".toml":
        return load_toml(path, read_geometry)
    raise UserError("not a scene", file=path, got=path.suffix or "no extension", expected=".toml")


def read_geometry(name: str, folder: Path) -> Parts:
    """Objects, and what comes with them, of a geometry file in `folder` or of a built-in scene."""
    if name.startswith(BUILTIN_PREFIX):
        return Parts(tuple(_builtin(name.removeprefix(BUILTIN_PREFIX))()))
    path = inside(folder, name)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise UserError("unknown geometry format", file=path, got=path.suffix, expected=" or ".join(READERS))
    return reader(path)


def _builtin(name: str) -> Callable[[], list[SceneObject]]:
    if name not in BUILTIN:
        known = ", ".join(BUILTIN_PREFIX + n for n in BUILTIN)
        raise UserError("unknown built-in scene", got=name, expected=known, hint=did_you_mean(name, BUILTIN))
    return BUILTIN[name]
