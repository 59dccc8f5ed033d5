"""The open scene as .glb, scene.toml and copies of the files that it uses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import bpy

from .assigned import material_notes, materials_of
from .cameras import cameras_of, paths_of
from .files import Copies, UniqueNames, missing_files
from .geometry import LOST, SOLID, Named, as_rendered, escaped, renderable, write_glb
from .lamps import FACE, Lamps
from .properties import WISHES, setting
from .surroundings import environment_of, with_sun
from .toml_text import toml_of
from .units import Frame

MARK = "# Exported from Blender by Lambent; the next export replaces this file."
MOST_GROUPS = 7


class ExportError(RuntimeError):
    """What keeps a scene from being exported, in one line."""


@dataclass(frozen=True)
class Exported:
    """The scene.toml, and a sentence for each thing that it does not carry."""

    scene: Path
    notes: tuple


def folder_of(file):
    """Where the scene of a .blend is exported to by default."""
    return Path(file).with_suffix(".lambent")


def export_scene(folder, name, context=None):
    """Export the open scene into a folder; `name` is that of the .glb, without ending."""
    context = context or bpy.context
    scene, view_layer, target = context.scene, context.view_layer, Path(folder) / "scene.toml"
    shown = renderable(scene, view_layer)
    if not any(o.type in SOLID or o.instance_type == "COLLECTION" for o in shown):
        raise ExportError(f"scene {scene.name} has nothing to export: no mesh is visible in renders")
    if target.exists() and not target.read_text("utf-8", "replace").startswith(MARK):
        raise ExportError(f"{target} is not an export of Blender: choose another folder, or move it")
    notes = []
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with as_rendered(scene, view_layer, shown):
            depsgraph = context.evaluated_depsgraph_get()
            document = _document(scene, depsgraph, shown, target.parent, name, notes.append)
        target.write_text(f"{MARK}\n{toml_of(document)}", "utf-8")
    except OSError as error:
        raise ExportError(f"{target.parent} cannot be written ({error.strerror})") from error
    return Exported(target, tuple(dict.fromkeys(notes)))


def _document(scene, depsgraph, shown, folder, name, note):
    frame, copies = Frame(scene), Copies(folder, note)
    geometry = folder / f"{name}.glb"
    named = Named(write_glb(geometry))
    if not named.objects:
        raise ExportError(f"scene {scene.name} has nothing to export: its meshes have no faces")
    world = environment_of(scene.world, copies, note)
    plain = world is None or world["kind"] == "constant"
    lamps = _lamps(shown, depsgraph, named, Lamps(frame, copies, note, plain))
    if lamps.soft_sun is not None:
        world = with_sun(world, *lamps.soft_sun, copies)
    for sentence in missing_files():
        note(sentence)
    for what in sorted({o.type for o in shown} & LOST):
        note(f"{what.lower()} objects are left out: {', '.join(o.name for o in shown if o.type == what)}")
    files = [{"file": geometry.name, "scale": frame.metres}]
    materials, measured = materials_of(named, copies)
    material_notes(named, materials, note)
    if lamps.obj:
        (folder / "area_lights.obj").write_text("\n".join(lamps.obj) + "\n", "utf-8")
        files.append({"file": "area_lights.obj"})
        materials[FACE] = {"kd": 0.0}
    objects = {**_light_fields(shown, named), **lamps.objects}
    found = {
        "format": "lambent-scene", "version": 1, "name": name, "geometry": files,
        "exposure_ev": _exposure(scene, note), "environment": world,
        "materials": materials, "measured": measured, "objects": objects, "lights": lamps.lights,
        "light_groups": _light_groups(scene, named, lamps, note),
        "cameras": cameras_of(scene, frame, depsgraph, note), "paths": paths_of(scene, frame, depsgraph, note),
    }  # fmt: skip
    return {key: value for key, value in found.items() if value not in (None, {}, [])}


def _lamps(shown, depsgraph, named, lamps):
    """All lamps, those of instanced collections included, under names that no object has."""
    names = {o.name_full for o in shown}
    placed = [(o, o.matrix_world) for o in shown if o.type == "LIGHT"]
    for one in depsgraph.object_instances:
        if one.is_instance and one.object.type == "LIGHT" and one.parent.original.name_full in names:
            placed.append((one.object.original, one.matrix_world.copy()))
    taken = UniqueNames(name for parts in named.objects.values() for name, _ in parts)
    for o, matrix in placed:
        if o.hide_render or getattr(getattr(o.data, "cycles", None), "is_portal", False):
            continue
        plain = "".join(c if c.isprintable() and c not in "#\\" else " " for c in o.name)  # as OBJ can hold it
        name = taken.unique(" ".join(plain.split()) or "light")
        lamps.names.setdefault(o.name_full, []).append(name)
        lamps.add(name, o.data, matrix)
    lamps.finish()
    return lamps


def _light_fields(shown, named):
    wishes = [(o.name, _wish(o)) for o in shown]
    return {pattern: {"light_field": wish} for name, wish in wishes if wish for pattern in named.patterns(name)}


def _wish(o):
    wanted = setting(o, "lambent_light_field")
    return WISHES.get(wanted.upper()) if isinstance(wanted, str) else bool(wanted)


def _light_groups(scene, named, lamps, note):
    """Collections that are light groups, with their lamps and objects that emit light."""
    found, names = [], UniqueNames()
    for collection in scene.collection.children_recursive:
        if not setting(collection, "lambent_light_group"):
            continue
        members = [name for o in collection.all_objects for name in lamps.names.get(o.name_full, ())]
        members = [escaped(name) for name in members]
        members += [p for o in collection.all_objects for p in named.patterns(o.name, emitting=True)]
        if not members:
            note(f"light group {collection.name}: left out, nothing in it emits light")
        elif len(found) == MOST_GROUPS:
            note(f"light group {collection.name}: left out, there are more than {MOST_GROUPS}")
        else:
            found.append({"name": names.unique(collection.name[:36]), "members": members})
    return found


def _exposure(scene, note):
    """Stops: those of the view, and of the film."""
    view = scene.view_settings
    if abs(view.gamma - 1) > 1e-6 or view.use_curve_mapping:
        note("view: its gamma and curves are not carried")
    film = getattr(getattr(scene, "cycles", None), "film_exposure", 1.0)
    return min(max(view.exposure + math.log2(max(film, 1e-9)), -30.0), 30.0)
