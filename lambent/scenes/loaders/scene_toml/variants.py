"""The variants of a scene.toml: those of its geometry files, and its [[variants]], which may add to them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from lambent.core.errors import UserError
from lambent.core.light_mix import LightMix, mix_of
from lambent.materials.document import Material, material_from
from lambent.materials.recolour import hex_colour
from lambent.scenes.loaders.scene_toml.assembly import check_material, fitting
from lambent.scenes.loaders.scene_toml.schema import VariantSection
from lambent.scenes.scene import Look, Scene
from lambent.scenes.variants import Dressed, look_of

USE, FILE, COLOUR = "use", "file", "colour"
ReadMaterial = Callable[[str, str], Material]  # name of a file as written, and the field that names it


def variants_told(
    sections: Sequence[VariantSection],
    of_geometry: Mapping[str, Sequence[str]],
    scene: Scene,
    read: ReadMaterial,
    path: Path,
) -> list[Dressed]:
    """The variants of a scene.toml.

    Parameters
    ----------
    of_geometry : mapping
        Variants of the geometry files: the material of each of the scene's objects.
    read : callable
        Reads a material's document.

    Raises
    ------
    UserError
        Where a section names what is not there, or says what cannot be.
    """
    for name, times in Counter(section.name for section in sections).items():
        if times > 1:
            raise UserError("name is used twice", file=path, field="variants", got=name)
    described = {section.name: section for section in sections}
    as_loaded = [o.material for o in scene.objects]
    told = []
    for name in dict.fromkeys([*of_geometry, *described]):
        worn = list(of_geometry.get(name, as_loaded))
        section = described.get(name) or VariantSection(name=name)
        worn = _exchanged(section, worn, scene, path)
        looks = _looks(section, scene, read, path)
        told.append(Dressed(name, [looks[material] for material in worn], _mix(section, path)))
    return told


def _exchanged(section: VariantSection, worn: list[str], scene: Scene, path: Path) -> list[str]:
    """The materials of objects, where the section exchanges some; later patterns win."""
    names = [o.name for o in scene.objects]
    for pattern, material in section.objects.items():
        field = f"variants.{section.name}.objects.{pattern}"
        check_material(material, scene.materials, path, field)
        fitting(pattern, names, path, field)
        worn = [material if fnmatchcase(name, pattern) else was for name, was in zip(names, worn, strict=True)]
    return worn


def _looks(section: VariantSection, scene: Scene, read: ReadMaterial, path: Path) -> dict[str, Look]:
    """The look of each of the scene's materials."""
    found = {name: look_of(scene, name) for name in scene.materials}
    changed = {}
    for name, table in section.materials.items():
        field = f"variants.{section.name}.materials.{name}"
        check_material(name, scene.materials, path, field)
        changed[name] = _look(table, found, name, read, path, field)
    return {**found, **changed}


def _look(
    table: Mapping[str, Any], looks: Mapping[str, Look], name: str, read: ReadMaterial, path: Path, field: str
) -> Look:
    """Another material of the scene, another document, or the same material with other numbers."""
    for key in (USE, FILE):
        if key in table and len(table) > 1:
            raise UserError(f"says more than {key}", file=path, field=field, got=sorted({*table} - {key})[0])
        if not isinstance(table.get(key, ""), str):
            raise UserError("is not a name", file=path, field=f"{field}.{key}", got=table[key])
    if USE in table:
        check_material(table[USE], {name: look.material for name, look in looks.items()}, path, f"{field}.{USE}")
        return looks[table[USE]]
    if FILE in table:
        return Look(read(table[FILE], f"{field}.{FILE}"))
    if not table:
        expected = "use, file, colour, or keys of a material document"
        raise UserError("says nothing", file=path, field=field, expected=expected)
    now = looks[name]
    numbers = dict(table)
    if COLOUR in numbers:
        if "kd" in numbers:
            raise UserError("says its colour twice, by colour and kd", file=path, field=field)
        numbers["kd"] = hex_colour(str(numbers[COLOUR]))
        if numbers["kd"] is None:
            raise UserError(
                "not a colour", file=path, field=f"{field}.{COLOUR}", got=numbers[COLOUR], expected="#rrggbb"
            )
        del numbers[COLOUR]
    return replace(now, material=material_from(_with_numbers(now.material, numbers), f"{path}: {field}"))


def _with_numbers(material: Material, numbers: Mapping[str, Any]) -> dict[str, Any]:
    """A document with some of its keys replaced: where it was fitted to no longer says what it is."""
    return {**material.model_dump(mode="json", exclude={"provenance"}), **numbers}


def _mix(section: VariantSection, path: Path) -> LightMix:
    """The mix of light groups; which groups there are is known after the bake."""
    mix = LightMix()
    for name, value in section.light.items():
        try:
            mix = mix.changed(name, mix_of(str(value), str(value)))
        except UserError as error:
            field = f"variants.{section.name}.light.{name}"
            expected = "an intensity, off, a temperature as 2700K, #rrggbb, or several with commas"
            raise UserError(error.message, file=path, field=field, got=value, expected=expected) from error
    return mix
