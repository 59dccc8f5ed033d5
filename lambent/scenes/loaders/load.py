"""`load_scene`: one door for every scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

from lambent.core.errors import UserError, did_you_mean
from lambent.scenes.builtin.box import box
from lambent.scenes.builtin.room import room
from lambent.scenes.loaders.defaults import with_defaults
from lambent.scenes.loaders.gltf import read_gltf
from lambent.scenes.loaders.mitsuba.scene import read_mitsuba
from lambent.scenes.loaders.obj import read_obj
from lambent.scenes.loaders.parts import Parts
from lambent.scenes.loaders.ply import read_ply
from lambent.scenes.loaders.toml import inside_scene, load_toml
from lambent.scenes.scene import Scene, SceneObject
from lambent.scenes.validation import size_warnings

BUILTIN_PREFIX = "builtin:"
BUILTIN: dict[str, Callable[[], tuple[SceneObject, ...]]] = {"room": room, "box": box}
READERS: dict[str, Callable[[Path, Path | None], Parts]] = {
    ".glb": read_gltf, ".gltf": read_gltf, ".obj": read_obj, ".xml": read_mitsuba, ".ply": read_ply,
}  # fmt: skip


def load_scene(path_or_builtin: str | Path) -> Scene:
    """The scene of a file, or a built-in one.

    Parameters
    ----------
    path_or_builtin : str or Path
        "builtin:room", "builtin:box", or the path of a scene.toml, .glb, .gltf, .obj, .ply or Mitsuba's .xml; light
        and a camera, where such a file has none, are added.

    Raises
    ------
    UserError
        Where there is no such scene, or its file cannot be used.
    """
    scene = _load(path_or_builtin)
    return replace(scene, warnings=(*scene.warnings, *size_warnings(scene)))


def _load(path_or_builtin: str | Path) -> Scene:
    text = str(path_or_builtin)
    if text.startswith(BUILTIN_PREFIX):
        name = text.removeprefix(BUILTIN_PREFIX)
        _builtin(name)  # raises the error of an unknown name
        return load_toml(Path(str(files("lambent.scenes.builtin") / f"{name}.toml")), read_geometry)
    path = Path(path_or_builtin)
    if path.suffix.lower() == ".toml":
        return load_toml(path, read_geometry)
    return with_defaults(path.stem, _reader(path)(path, None))


def read_geometry(name: str, scene_file: Path) -> Parts:
    """Objects, and what comes with them, of a built-in scene or of a file that `scene_file` names."""
    if name.startswith(BUILTIN_PREFIX):
        return Parts(_builtin(name.removeprefix(BUILTIN_PREFIX))())
    path = inside_scene(scene_file, "geometry", name)
    return _reader(path)(path, scene_file.resolve().parent)


def _reader(path: Path) -> Callable[[Path, Path | None], Parts]:
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        expected = ", ".join([*READERS, ".toml"])
        raise UserError("unknown kind of scene", file=path, got=path.suffix or "no extension", expected=expected)
    return reader


def _builtin(name: str) -> Callable[[], tuple[SceneObject, ...]]:
    if name not in BUILTIN:
        known = ", ".join(BUILTIN_PREFIX + n for n in BUILTIN)
        raise UserError("unknown built-in scene", got=name, expected=known, hint=did_you_mean(name, BUILTIN))
    return BUILTIN[name]
