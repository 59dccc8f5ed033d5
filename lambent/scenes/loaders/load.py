"""`load_scene`: built-in scenes, scene.toml, and every format that has a module among the loaders.

A format is a module or folder in `scenes/loaders` with NAME, ENDINGS and load(path, options) -> Contents; `options` are
`contents.LoadOptions`. A format that shares its suffix with other files also has recognise(head), which recognises a
scene by its first bytes.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from types import ModuleType

import numpy as np

from lambent.core.discovery import known, modules_in
from lambent.core.errors import UserError
from lambent.core.inputs import BUILTIN_PREFIX, foreign_bytes
from lambent.materials.document import Material
from lambent.scenes import builtin, loaders
from lambent.scenes.loaders.blender import BLEND, exported
from lambent.scenes.loaders.contents import Contents, LoadOptions
from lambent.scenes.loaders.meshes.flush import with_flush_raised
from lambent.scenes.loaders.meshes.inverted import with_solids_outwards
from lambent.scenes.loaders.meshes.repair import box_mapped, deviation_warnings, with_creases
from lambent.scenes.loaders.scene_files import SceneFiles
from lambent.scenes.loaders.scene_toml.document import load_toml
from lambent.scenes.photometry.luminous_surfaces import with_luminous_surfaces
from lambent.scenes.scene import MaterialTextures, Mesh, Scene, SceneObject
from lambent.scenes.validation import reflectance_warnings, size_warnings

TOML = ".toml"
TOLD = 2  # objects named individually in warnings of one kind
CALLED = {"material", "picture", "light", "camera"}  # what warnings call things that are not objects


def load_scene(path_or_builtin: str | Path, crease_deg: float | None = None) -> Scene:
    """Load the scene of a file, or a built-in one.

    Parameters
    ----------
    path_or_builtin : str or Path
        "builtin:room", "builtin:box", or the path of a scene.toml, .glb, .gltf, .obj, .ply, .bpt, Mitsuba's .xml or
        Blender's .blend, which is exported beside it first; light and a camera are added to a file without them.
    crease_deg : float, optional
        0 to 180. Normals that are missing or lean far from their faces are recomputed: smooth where faces meet at less
        than this angle.

    Raises
    ------
    UserError
        If there is no such scene, or its file is unusable.
    """
    if Path(path_or_builtin).suffix.lower() == BLEND:
        file, lost = exported(Path(path_or_builtin))
        scene = load_scene(file, crease_deg)
        return replace(scene, warnings=(*lost, *scene.warnings))
    scene, text = _load(path_or_builtin, crease_deg), str(path_or_builtin)
    origin = text if text.startswith(BUILTIN_PREFIX) else os.path.abspath(text)
    scene = with_uv(with_luminous_surfaces(with_solids_outwards(scene)))
    angle = scene.crease_deg if crease_deg is None else crease_deg
    if angle is not None:
        scene = replace(scene, objects=with_creases(scene.objects, angle), crease_deg=angle)
    notes = deviation_warnings(scene.objects) if angle is None else []
    told = counted([*scene.warnings, *reflectance_warnings(scene)])
    scene = replace(scene, warnings=(*told, *notes, *size_warnings(scene)), origin=origin)
    return with_flush_raised(scene)


def with_uv(scene: Scene) -> Scene:
    """The scene with box-mapped uv, in metres, for objects whose uv is one point, so that they can show an image.

    Objects with textures stay: their one point may be a swatch of a palette.
    """
    looks = [(name, look) for variant in scene.variants for name, look in variant.looks.items()]
    textured = {*scene.textures, *(name for name, look in looks if isinstance(look.textures, str) and look.textures)}
    found: dict[int, Mesh] = {}  # by mesh, because instances share theirs

    def mapped(o: SceneObject) -> SceneObject:
        mesh = o.mesh
        if o.material in textured:
            return o
        if id(mesh) not in found:
            is_point = len(mesh.uv) > 0 and not np.ptp(mesh.uv, axis=0).any()
            uv = box_mapped(mesh.positions, mesh.normals).astype(np.float32) if is_point else mesh.uv
            found[id(mesh)] = replace(mesh, uv=uv) if is_point else mesh
        return o if found[id(mesh)] is mesh else replace(o, mesh=found[id(mesh)])

    return replace(scene, objects=tuple(map(mapped, scene.objects)))


def counted(warnings: Sequence[str]) -> list[str]:
    """Warnings, with those that more than TOLD objects share merged into one with their number, at the first place."""
    shared: dict[str, list[str]] = {}
    for warning in warnings:
        name, _, what = warning.partition(": ")
        shared.setdefault(what, []).append(name)
    told = dict.fromkeys(
        warning if not (what := warning.partition(": ")[2]) or len(shared[what]) <= TOLD
        else f"{_number_of(shared[what])}: {what} ({', '.join(shared[what][:TOLD])}, ...)"
        for warning in warnings
    )  # fmt: skip
    return list(told)


def _number_of(names: Sequence[str]) -> str:
    """How many there are, and of what, if their names say it: "3 materials"."""
    kinds = {name.partition(" ")[0] for name in names}
    return f"{len(names)} {kinds.pop() if len(kinds) == 1 and kinds <= CALLED else 'object'}s"


def _load(path_or_builtin: str | Path, crease_deg: float | None) -> Scene:
    text = str(path_or_builtin)
    if text.startswith(BUILTIN_PREFIX):
        name = _builtin_name(text)
        return load_toml(Path(str(files(builtin) / f"{name}{TOML}")), read_geometry, crease_deg)
    path = Path(path_or_builtin)
    if path.suffix.lower() == TOML:
        with foreign_bytes("scene.toml", path):
            return load_toml(path, read_geometry, crease_deg)
    return _contents(path, LoadOptions(crease_deg=crease_deg)).scene(path.stem)


def read_geometry(name: str, scene_file: Path, scene_files: SceneFiles, crease_deg: float | None) -> Contents:
    """Objects and other contents of a built-in scene, or of a file that `scene_file` refers to."""
    if name.startswith(BUILTIN_PREFIX):
        module = import_module(f"{builtin.__name__}.{_builtin_name(name)}")
        make: Callable[[], tuple[SceneObject, ...]] = module.objects
        textured: Callable[[], dict[str, tuple[Material, MaterialTextures]]] = getattr(module, "textured", dict)
        surfaces = textured()
        return Contents(
            make(),
            materials={name: material for name, (material, _) in surfaces.items()},
            textures={name: textures for name, (_, textures) in surfaces.items()},
        )
    path = scene_files.path(name, scene_file, "geometry")
    return _contents(path, LoadOptions(scene_files.root, crease_deg))


def _contents(path: Path, options: LoadOptions) -> Contents:
    module = _format_of(path)
    with foreign_bytes(module.NAME, path):
        contents: Contents = module.load(path, options)
    return contents


def is_scene(path: Path, head: bytes) -> bool:
    """Whether a file that begins with `head` is a scene, by its ending and its first bytes."""
    modules = [m for m in formats() if path.suffix.lower() in m.ENDINGS]
    return path.suffix.lower() in (TOML, BLEND) or any(
        not hasattr(m, "recognise") or m.recognise(head) for m in modules
    )


def formats() -> list[ModuleType]:
    """The available formats, by module name."""
    return list(modules_in(loaders, having="ENDINGS").values())


def _format_of(path: Path) -> ModuleType:
    module = next((m for m in formats() if path.suffix.lower() in m.ENDINGS), None)
    if module is None and not path.exists():
        raise UserError("cannot be read (no such file)", file=path)
    if module is None:
        expected = ", ".join([*(ending for m in formats() for ending in m.ENDINGS), TOML, BLEND])
        got = "a folder" if path.is_dir() else path.suffix or "no file extension"
        raise UserError("unknown scene format", file=path, got=got, expected=expected)
    return module


def _builtin_name(text: str) -> str:
    """The name after "builtin:"; a built-in scene is a .toml and a module in `scenes/builtin`.

    The module has `objects()`, and `textured()` if some of its materials have textures.
    """
    names = sorted(Path(f.name).stem for f in files(builtin).iterdir() if f.name.endswith(TOML))
    return known("built-in scene", text.removeprefix(BUILTIN_PREFIX), names)
