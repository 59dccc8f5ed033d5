"""scene.toml: a scene described in text, its geometry in files beside it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from lambent.core.errors import UserError, invalid
from lambent.core.geometry.triangles import triangle_areas
from lambent.core.plain import Triple
from lambent.materials.document import Material, material_from
from lambent.scenes.first_view import first_views
from lambent.scenes.light_groups import SKY, SUN, names_of_lights
from lambent.scenes.loaders.contents import DAYLIGHT, Contents, emission_warnings
from lambent.scenes.loaders.scene_files import SceneFiles
from lambent.scenes.loaders.scene_toml.assembly import assembled, assigned, check_material, fitting
from lambent.scenes.loaders.scene_toml.lamps import IesSection, coloured
from lambent.scenes.loaders.scene_toml.material_files import LookFiles, material_of_file
from lambent.scenes.loaders.scene_toml.placing import placed
from lambent.scenes.loaders.scene_toml.schema import (
    GeometrySection,
    ImageSection,
    ObjectSection,
    SceneDocument,
    known_keys,
)
from lambent.scenes.loaders.scene_toml.text import toml_of
from lambent.scenes.loaders.scene_toml.variants import parse_variants
from lambent.scenes.loaders.surfaces.surface import UNDESCRIBED
from lambent.scenes.looks.variants import with_variants
from lambent.scenes.photometry.files import read_luminaire
from lambent.scenes.scene import (
    Environment,
    ImageEnvironment,
    Light,
    LightFieldWish,
    LightGroup,
    Mesh,
    ReflectorRule,
    Scene,
    SceneObject,
)

# Required at the beginning of every scene.toml.
HEAD = {"format": 'format = "lambent-scene"', "version": "version = 1", "geometry": 'geometry = "model.glb"'}
# Takes the name as written, the scene.toml, the files below its folder, and the crease angle.
ReadGeometry = Callable[[str, Path, SceneFiles, float | None], Contents]


def load_toml(path: Path, read_geometry: ReadGeometry, crease_deg: float | None = None) -> Scene:
    """Scene of a scene.toml; files that it refers to must be in its folder or below. `crease_deg` replaces its own.

    Raises
    ------
    UserError
        If the file is not TOML, has an unknown key or an invalid value, or refers to something missing.
    """
    document, files = _parse(path), SceneFiles(path)
    there, missing = _there(document, path, files)
    angle = document.crease_angle if crease_deg is None else crease_deg
    contents = [placed(read_geometry(entry.file, path, files, angle), entry.scale, entry.up, path) for entry in there]
    for source in (s for c in contents for s in c.sources):
        files.use(source)
    environment = _environment(document, path, files) or next((c.environment for c in contents if c.environment), None)
    whole = assembled(contents, document.variant, path)
    described = _materials(document, path, files)
    materials = {**whole.materials, **described}
    objects, unfit = assigned(document.assign, whole.objects, materials, path)
    objects, centres, planes, light_fields = _apply(document, objects, path)
    for o in objects:
        check_material(o.material, materials, path, f"objects.{o.name}.material")
    sets = [c.variants for c in contents]
    by_variant = {
        name: _apply(document, assigned(document.assign, one.objects, materials, path)[0], path)[0]
        for name, one in ((name, assembled(contents, name, path)) for name in dict.fromkeys(chain(*sets)))
    }
    if isinstance(environment, ImageEnvironment):
        files.use(environment.file)
    cameras = tuple(c.camera(c.name) for c in document.cameras) or tuple(v for c in contents for v in c.cameras)
    lights = (*(light for c in contents for light in c.lights), *_lights(document, path, files))
    needless = {f"material {name}: {UNDESCRIBED}" for name in described}
    notes = (
        *(note for note in whole.warnings if note not in needless),
        *unfit,
        *missing,
        *_idle_patterns(described, objects),
        *emission_warnings(objects, by_variant),
    )
    if environment is None and not lights and not any(any(o.emission) for o in objects):
        environment, notes = DAYLIGHT, (*notes, "it has no light: daylight is added")
    _check_names([c.name for c in cameras], path, "cameras")
    _check_names([p.name for p in document.paths], path, "paths")
    _check_names([g.name for g in document.grids], path, "grids")
    scene = Scene(
        name=document.name,
        objects=objects,
        materials=materials,
        environment=environment,
        lights=lights,
        cameras=cameras or first_views(objects),
        paths=tuple(section.path() for section in document.paths),
        exposure_ev=document.exposure,
        sources=tuple(files.sources),
        warnings=(*notes, *files.notes),
        textures={name: t for name, t in whole.textures.items() if name not in described},
        measured=_measured(document, materials, path, files),
        probe_planes=planes,
        probe_centres=centres,
        light_fields=light_fields,
        reflector_rules=_reflector_rules(document, objects, path),
        crease_deg=document.crease_angle,
        light_groups=_light_groups(document, objects, lights, path),
        grids=tuple(g.grid(objects, path, f"grids.{g.name}") for g in document.grids),
        caption=document.caption,
        credit=document.credit or "; ".join(dict.fromkeys(c.credit for c in contents if c.credit)),
    )
    of_geometry = {name: [o.material for o in changed] for name, changed in by_variant.items()}
    variants = parse_variants(document.variants, of_geometry, scene, LookFiles(path, files))
    return replace(with_variants(scene, variants), sources=tuple(files.sources))


def _there(document: SceneDocument, path: Path, files: SceneFiles) -> tuple[list[GeometrySection], list[str]]:
    """The geometry files that exist, and a note for each missing one; `UserError` if all are missing."""
    names = [entry.file for entry in document.geometry]
    gone = [
        name for name in names
        if not name.startswith("builtin:") and not files.path(name, path, "geometry").is_file()
    ]  # fmt: skip
    if len(gone) == len(names):
        raise UserError(f"no geometry file was found: {', '.join(gone)}", file=path, field="geometry")
    there = [entry for entry, name in zip(document.geometry, names, strict=True) if name not in gone]
    return there, [f"geometry {name} is missing: left out" for name in gone]


def _parse(path: Path) -> SceneDocument:
    written = toml_of(path)
    if missing := next((key for key in HEAD if key not in written), None):
        raise UserError("is missing", file=path, field=missing, hint=f"write {HEAD[missing]} above the first [table]")
    try:
        return SceneDocument.model_validate(written)
    except ValidationError as error:
        raise invalid(error, path, known_keys()) from error


def _idle_patterns(described: Iterable[str], objects: Iterable[SceneObject]) -> list[str]:
    """A warning for each described material that is named by a pattern and that no object has."""
    used = {o.material for o in objects}
    idle = [name for name in described if {*name} & {*"*?"} and name not in used]
    return [
        f"materials.{name} is a name, not a pattern, and no object has it: assign it under [assign]" for name in idle
    ]


def _materials(document: SceneDocument, path: Path, files: SceneFiles) -> dict[str, Material]:
    """Materials described in the document, or in files that it refers to."""
    materials = {}
    for name, table in document.materials.items():
        where = f"{path}: materials.{name}"
        if "file" in table:
            if len(table) > 1:
                raise UserError("has other keys beside file", file=where, got=sorted(set(table) - {"file"})[0])
            field = f"materials.{name}.file"
            if not isinstance(table["file"], str):
                raise UserError("is not a file name", file=path, field=field, got=table["file"])
            materials[name] = material_of_file(table["file"], field, path, files).model_copy(update={"name": name})
        else:
            materials[name] = material_from({"name": name, **table}, where)
    return materials


def _measured(
    document: SceneDocument, materials: Mapping[str, Material], path: Path, files: SceneFiles
) -> dict[str, Path]:
    """Table files that replace materials during the bake, by material."""
    for name in document.measured:
        check_material(name, materials, path, f"measured.{name}")
    return {name: files.path(file, path, f"measured.{name}") for name, file in document.measured.items()}


def _apply(
    document: SceneDocument, objects: tuple[SceneObject, ...], path: Path
) -> tuple[tuple[SceneObject, ...], dict[str, Triple], dict[str, Any], dict[str, LightFieldWish]]:
    """Objects with the document's settings; probes' centres and planes, and light fields, by object.

    Later patterns win.
    """
    by_name = {o.name: o for o in objects}
    centres: dict[str, Triple] = {}
    planes: dict[str, Any] = {}
    light_fields: dict[str, LightFieldWish] = {}
    for pattern, section in document.objects.items():
        settings = section.model_dump(exclude_none=True)
        centre, own_planes = settings.pop("probe_centre", None), settings.pop("probe_planes", None)
        for key in ("luminance", "lumens", "colour", "light_field"):
            settings.pop(key, None)
        for name in fitting(pattern, by_name, path, f"objects.{pattern}"):
            by_name[name] = replace(by_name[name], **settings, **_light_of(by_name[name].mesh, section))
            if centre is not None:
                centres[name] = centre
            if own_planes is not None:
                planes[name] = _unit_planes(own_planes)
            if section.light_field is not None:
                light_fields.pop(name, None)
                light_fields |= {name: section.light_field.wish} if section.light_field.use else {}
    return tuple(by_name.values()), centres, planes, light_fields


def _reflector_rules(
    document: SceneDocument, objects: tuple[SceneObject, ...], path: Path
) -> tuple[ReflectorRule, ...]:
    for section in document.reflectors:
        fitting(section.objects, [o.name for o in objects], path, "reflectors.objects", got=section.objects)
    return tuple(ReflectorRule(r.objects, r.use, r.plane) for r in document.reflectors)


def _light_groups(
    document: SceneDocument, objects: tuple[SceneObject, ...], lights: tuple[Light, ...], path: Path
) -> tuple[LightGroup, ...]:
    """The groups that the document names; every member must match something."""
    names = [SUN, SKY, *(o.name for o in objects if any(o.emission)), *names_of_lights(lights)]
    for section in document.light_groups:
        for member in section.members:
            fitting(member, names, path, "light_groups.members", got=member)
    _check_names([section.name for section in document.light_groups], path, "light_groups")
    return tuple(section.group() for section in document.light_groups)


def _unit_planes(planes: Any) -> Any:
    """(P, 4) planes with normals of unit length."""
    array = np.asarray(planes, np.float32).reshape(-1, 4)
    return array / np.linalg.norm(array[:, :3], axis=-1, keepdims=True)


def _lights(document: SceneDocument, path: Path, files: SceneFiles) -> list[Light]:
    found: list[Light] = []
    for section in document.lights:
        if isinstance(section, IesSection):
            file = files.path(section.file, path, "lights.file")
            if not file.is_file():
                raise UserError("file not found", file=path, field="lights.file", got=section.file)
            found.append(section.light_of(read_luminaire(file, files)))
        else:
            found.append(section.light())
    return found


def _light_of(mesh: Mesh, section: ObjectSection) -> dict[str, Any]:
    """The emission of an object whose section gives it in photometric units."""
    if section.luminance is None and section.lumens is None:
        return {}
    area_m2 = float(triangle_areas(mesh.corners).sum())
    of_flux = (section.lumens or 0.0) / max(np.pi * area_m2, 1e-12)
    return {"emission": coloured(section.luminance if section.luminance is not None else of_flux, section.colour)}


def _environment(document: SceneDocument, path: Path, files: SceneFiles) -> Environment | None:
    section = document.environment
    if not isinstance(section, ImageSection):
        return None if section is None else section.environment()
    file = files.path(section.file, path, "environment.file")
    if not file.is_file():
        raise UserError(f"file not found: {section.file}", file=path, field="environment.file")
    return ImageEnvironment(file, section.scale, section.rotation_deg, section.layout, section.up)


def _check_names(names: list[str], path: Path, field: str) -> None:
    for name, count in Counter(names).items():
        if count > 1:
            raise UserError("name is used twice", file=path, field=field, got=name)
