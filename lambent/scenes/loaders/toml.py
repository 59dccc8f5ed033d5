"""scene.toml: a scene in words, its geometry in files beside it."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from lambent.core.camera import Camera, CameraPath
from lambent.core.errors import UserError, did_you_mean
from lambent.core.files import inside, read_bytes
from lambent.materials.document import Material, load_material, material_from
from lambent.scenes.geometry import transformed
from lambent.scenes.loaders.assembly import assembled, assigned
from lambent.scenes.loaders.parts import Parts
from lambent.scenes.loaders.schema import (
    ConstantSection,
    DirectionalSection,
    GeometrySection,
    ImageSection,
    PointSection,
    SceneDocument,
    SpotSection,
    ViewSection,
    known_keys,
)
from lambent.scenes.scene import (
    ConstantEnvironment,
    DirectionalLight,
    Environment,
    ImageEnvironment,
    Light,
    PointLight,
    ReflectorRule,
    Scene,
    SceneObject,
    SunSky,
    Triple,
)

LIMIT_BYTES = 4 << 20
ReadGeometry = Callable[[str, Path], Parts]  # name as written, the scene.toml that names it


def load_toml(path: Path, read_geometry: ReadGeometry) -> Scene:
    """Scene of a scene.toml; files it names lie in its folder or below.

    Raises
    ------
    UserError
        Where the file is not TOML, says something unknown or impossible, or names what is not there.
    """
    document = _parse(path)
    parts = [_geometry(entry, path, read_geometry) for entry in document.geometry]
    environment = _environment(document, path) or next((p.environment for p in parts if p.environment), None)
    whole = assembled(parts, document.variant, path)
    named, sources = _materials(document, path)
    materials = {**whole.materials, **named}
    objects, unfit = assigned(document.assign, whole.objects, materials, path)
    objects, centres, planes = _apply(document, objects, path)
    for o in objects:
        if o.material not in materials:
            hint = did_you_mean(o.material, materials) or f"describe it under [materials.{o.material}]"
            raise UserError(
                "unknown material", file=path, field=f"objects.{o.name}.material", got=o.material, hint=hint
            )
    if isinstance(environment, ImageEnvironment):
        sources = (*sources, environment.file)
    cameras = tuple(_camera(c.name, c) for c in document.cameras) or tuple(c for p in parts for c in p.cameras)
    _no_twins([c.name for c in cameras], path, "cameras")
    _no_twins([p.name for p in document.paths], path, "paths")
    return Scene(
        name=document.name,
        objects=objects,
        materials=materials,
        environment=environment,
        lights=(*(light for p in parts for light in p.lights), *map(_light, document.lights)),
        cameras=cameras,
        paths=tuple(
            CameraPath(p.name, tuple(_camera(f"{p.name}_{i}", k) for i, k in enumerate(p.keys)), p.seconds)
            for p in document.paths
        ),
        exposure_ev=document.exposure_ev,
        sources=(path, *(s for p in parts for s in p.sources), *sources),
        warnings=(*whole.warnings, *unfit),
        textures={name: t for name, t in whole.textures.items() if name not in named},
        measured=_measured(document, materials, path),
        probe_planes=planes,
        probe_centres=centres,
        reflector_rules=_reflector_rules(document, objects, path),
    )


def _parse(path: Path) -> SceneDocument:
    try:
        data = tomllib.loads(read_bytes(path, LIMIT_BYTES).decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise UserError(f"not a TOML document ({error})", file=path) from error
    try:
        return SceneDocument.model_validate(data)
    except ValidationError as error:
        raise _one_line(error, path) from error


def _one_line(error: ValidationError, path: Path) -> UserError:
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        return UserError("unknown key", file=path, field=where, hint=did_you_mean(str(first["loc"][-1]), known_keys()))
    if first["type"] == "missing":
        return UserError("is missing", file=path, field=where)
    return UserError(first["msg"].removeprefix("Value error, "), file=path, field=where, got=first["input"])


def _geometry(entry: str | GeometrySection, path: Path, read_geometry: ReadGeometry) -> Parts:
    if isinstance(entry, str):
        return read_geometry(entry, path)
    parts = read_geometry(entry.file, path)
    matrix = np.diag([entry.scale] * 3 + [1.0])
    size = entry.scale

    def scaled(position: Triple) -> Triple:
        x, y, z = position
        return x * size, y * size, z * size

    return replace(
        parts,
        objects=tuple(replace(o, mesh=transformed(o.mesh, matrix)) for o in parts.objects),
        cameras=tuple(replace(c, position=scaled(c.position), target=scaled(c.target)) for c in parts.cameras),
        lights=tuple(
            replace(light, position=scaled(light.position)) if isinstance(light, PointLight) else light
            for light in parts.lights
        ),
    )


def _materials(document: SceneDocument, path: Path) -> tuple[dict[str, Material], tuple[Path, ...]]:
    """Materials said in the document, and the files some of them come from."""
    materials, sources = {}, []
    for name, table in document.materials.items():
        where = f"{path}: materials.{name}"
        if "file" in table:
            if len(table) > 1:
                raise UserError("says more than its file", file=where, got=sorted(set(table) - {"file"})[0])
            source = inside_scene(path, f"materials.{name}.file", table["file"])
            materials[name] = _material_of_file(source, f"materials.{name}.file", path)
            materials[name] = materials[name].model_copy(update={"name": name})
            sources.append(source)
        else:
            materials[name] = material_from({"name": name, **table}, where)
    return materials, tuple(sources)


def _measured(document: SceneDocument, materials: Mapping[str, Material], path: Path) -> dict[str, Path]:
    """Files of the tables that materials scatter by while the scene is baked."""
    for name in document.measured:
        if name not in materials:
            hint = did_you_mean(name, materials) or f"describe it under [materials.{name}]"
            raise UserError("unknown material", file=path, field=f"measured.{name}", got=name, hint=hint)
    return {name: inside_scene(path, f"measured.{name}", file) for name, file in document.measured.items()}


def _material_of_file(source: Path, field: str, path: Path) -> Material:
    """The document of a file; a measurement has to be fitted before it can be worn."""
    from lambent.materials.measured.registry import is_known

    if source.is_file() and not _begins_as_json(source) and is_known(source):
        fitted = source.with_suffix(".json").name
        hint = f"fit it first: lambent fit {source.name} -o {fitted}, then file = {fitted!r}"
        raise UserError("is a measurement, not a material", file=path, field=field, got=source.name, hint=hint)
    return load_material(source)


def _begins_as_json(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(64).lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{")


def inside_scene(path: Path, field: str, name: Any) -> Path:
    """A file named in a scene.toml: in its folder or below, nowhere else."""
    if not isinstance(name, str):
        raise UserError("is not a file name", file=path, field=field, got=name)
    try:
        return inside(path.parent, name)
    except UserError as error:
        hint = "put the file into the scene's folder or below"
        raise UserError(error.message, file=path, field=field, got=name, hint=hint) from error


def _apply(
    document: SceneDocument, objects: tuple[SceneObject, ...], path: Path
) -> tuple[tuple[SceneObject, ...], dict[str, Triple], dict[str, Any]]:
    """Objects with what the document says of them, and the probes' centres and planes by object; later lines win."""
    by_name = {o.name: o for o in objects}
    centres: dict[str, Triple] = {}
    planes: dict[str, Any] = {}
    for pattern, section in document.objects.items():
        names = [name for name in by_name if fnmatchcase(name, pattern)]
        if not names:
            hint = did_you_mean(pattern, by_name) or "see the names with `lambent inspect`"
            raise UserError("fits no object", file=path, field=f"objects.{pattern}", hint=hint)
        said = section.model_dump(exclude_none=True)
        centre, own_planes = said.pop("probe_centre", None), said.pop("probe_planes", None)
        for name in names:
            by_name[name] = replace(by_name[name], **said)
            if centre is not None:
                centres[name] = centre
            if own_planes is not None:
                planes[name] = _unit_planes(own_planes)
    return tuple(by_name.values()), centres, planes


def _reflector_rules(
    document: SceneDocument, objects: tuple[SceneObject, ...], path: Path
) -> tuple[ReflectorRule, ...]:
    names = [o.name for o in objects]
    for section in document.reflectors:
        if not any(fnmatchcase(name, section.objects) for name in names):
            hint = did_you_mean(section.objects, names) or "see the names with `lambent inspect`"
            raise UserError("fits no object", file=path, field="reflectors.objects", got=section.objects, hint=hint)
    return tuple(ReflectorRule(r.objects, r.use, r.plane) for r in document.reflectors)


def _unit_planes(planes: Any) -> Any:
    """(P, 4) planes with normals of unit length."""
    array = np.asarray(planes, np.float32).reshape(-1, 4)
    return array / np.linalg.norm(array[:, :3], axis=-1, keepdims=True)


def _environment(document: SceneDocument, path: Path) -> Environment | None:
    e = document.environment
    if e is None:
        return None
    if isinstance(e, ConstantSection):
        return ConstantEnvironment(e.radiance)
    if isinstance(e, ImageSection):
        file = inside_scene(path, "environment.file", e.file)
        if not file.is_file():
            raise UserError("file not found", file=path, field="environment.file", got=e.file)
        return ImageEnvironment(file, e.scale, e.rotation_deg)
    return SunSky(_unit(e.sun_direction), e.turbidity, e.albedo, e.sun_scale, e.sky_scale)


def _light(section: PointSection | SpotSection | DirectionalSection) -> Light:
    if isinstance(section, PointSection):
        return PointLight(section.position, section.intensity)
    if isinstance(section, SpotSection):
        direction = _unit(section.direction)
        return PointLight(section.position, section.intensity, direction, section.inner_deg, section.outer_deg)
    return DirectionalLight(_unit(section.direction), section.irradiance)


def _camera(name: str, view: ViewSection) -> Camera:
    return Camera(name, view.position, view.target, view.up, view.fov_y_deg)


def _unit(vector: Triple) -> Triple:
    x, y, z = np.asarray(vector, float) / np.linalg.norm(vector)
    return float(x), float(y), float(z)


def _no_twins(names: list[str], path: Path, field: str) -> None:
    for name in names:
        if names.count(name) > 1:
            raise UserError("name is used twice", file=path, field=field, got=name)
