"""Parse looks of materials and mixes of light from a scene.toml or a file of keyframes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from lambent.core.errors import UserError
from lambent.core.light.colour import hex_colour
from lambent.core.light.light_mix import GroupMix, mix_of
from lambent.materials.document import material_from
from lambent.scenes.loaders.scene_toml.assembly import check_material
from lambent.scenes.loaders.scene_toml.material_files import LookFiles
from lambent.scenes.looks.retexturing import texture_named, with_texture
from lambent.scenes.scene import ImageTexture, Look

USE, FILE, COLOUR, TEXTURE = "use", "file", "colour", "texture"
ALONE = USE, FILE  # keys that allow no others beside them


def parse_looks(
    tables: Mapping[str, Mapping[str, Any]],
    looks: Mapping[str, Look],
    coloured: Mapping[str, bool],
    files: LookFiles,
    where: str,
) -> dict[str, Look]:
    """Looks given by tables, by the names of the materials they replace.

    Parameters
    ----------
    looks : mapping
        Of all existing materials.
    coloured : mapping
        Whether textures have a diffuse part, by the material they belong to.
    files : LookFiles
        The file of the tables, and those that it refers to.
    where : str
        The field that contains the tables, for errors.
    """
    found = {}
    for name, table in tables.items():
        field = f"{where}.{name}"
        check_material(name, {name: look.material for name, look in looks.items()}, files.path, field)
        found[name] = _look(table, looks, name, coloured, files, field)
    return found


def parse_mixes(light: Mapping[str, str | float], path: Path, where: str) -> dict[str, GroupMix]:
    """Mixes of light groups given by a table; whether the groups exist is known only after the bake."""
    found = {}
    for name, value in light.items():
        try:
            found[name] = mix_of(str(value), str(value))
        except UserError as error:
            expected = "an intensity, off, 2700K, #rrggbb, or several joined by commas"
            raise UserError(error.message, file=path, field=f"{where}.{name}", got=value, expected=expected) from error
    return found


def _look(
    table: Mapping[str, Any],
    looks: Mapping[str, Look],
    name: str,
    coloured: Mapping[str, bool],
    files: LookFiles,
    field: str,
) -> Look:
    """Another material of the scene, another document, or the same material with another texture or other numbers."""
    path = files.path
    for key in (USE, FILE, TEXTURE):
        if key in table and len(table) > 1 and key in ALONE:
            raise UserError(f"has other keys beside {key}", file=path, field=field, got=sorted({*table} - {key})[0])
        if not isinstance(table.get(key, ""), str):
            raise UserError("is not a name", file=path, field=f"{field}.{key}", got=table[key])
    if USE in table:
        check_material(table[USE], {name: look.material for name, look in looks.items()}, path, f"{field}.{USE}")
        return looks[table[USE]]
    if FILE in table:
        return Look(files.material(table[FILE], f"{field}.{FILE}"))
    if not table:
        expected = "use, file, texture, colour, or keys of a material document"
        raise UserError("is empty", file=path, field=field, expected=expected)
    now, numbers = looks[name], dict(table)
    if TEXTURE in numbers:
        place = f"{field}.{TEXTURE}"
        of = texture_named(numbers.pop(TEXTURE), coloured, partial(files.image, field=place), place, path)
        if isinstance(of, ImageTexture):
            files.files.use(Path(of.file))
        now = with_texture(now, of, looks, {one for one, has_colour in coloured.items() if has_colour})
        if not numbers:
            return now
    if COLOUR in numbers:
        if "kd" in numbers:
            raise UserError("has two colours, colour and kd", file=path, field=field)
        numbers["kd"] = hex_colour(str(numbers[COLOUR]))
        if numbers["kd"] is None:
            raise UserError(
                "not a colour", file=path, field=f"{field}.{COLOUR}", got=numbers[COLOUR], expected="#rrggbb"
            )
        del numbers[COLOUR]
    document = now.material.model_dump(mode="json", exclude={"provenance"})  # which no longer applies
    return replace(now, material=material_from({**document, **numbers}, f"{path}: {field}"))
