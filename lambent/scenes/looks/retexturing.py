"""Exchange the textures of materials, by mean and detail: none, those of another material, or an image.

The exchanged texture brings its mean as the material's diffuse colour; lobes, and roughness where only an image is
exchanged, stay.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.plain import Triple, is_number
from lambent.materials.factored.albedo import possible_kd
from lambent.scenes.looks.image_textures import MOST_REPEAT, mean_and_detail
from lambent.scenes.scene import ImageTexture, Look, MaterialTextures

FIELD = "--texture"
NONE = "none"
NO_UV, NO_UV_HINT = "has no texture coordinates", "bake the scene again, or add uv to its geometry"


def parse_textures(texts: Sequence[str]) -> dict[str, str]:
    """The texture that each material gets, from texts MATERIAL=FILE[,REPEAT], MATERIAL=MATERIAL or MATERIAL=none."""
    found: dict[str, str] = {}
    for text in texts:
        name, _, value = (part.strip() for part in text.partition("="))
        if not name or not value:
            expected = "MATERIAL=FILE, MATERIAL=MATERIAL or MATERIAL=none"
            raise UserError("cannot be read as an exchanged texture", field=FIELD, got=text, expected=expected)
        if name in found:
            raise UserError("names a material twice", field=FIELD, got=name)
        found[name] = value
    return found


def retextured(
    looks: Mapping[str, Look],
    wanted: Mapping[str, str],
    textures: Mapping[str, MaterialTextures],
    without_uv: Collection[str],
) -> dict[str, Look]:
    """Looks with exchanged textures; only changed ones.

    Parameters
    ----------
    looks : mapping
        All materials of the scene, as they would be shown.
    wanted : mapping
        As of `parse_textures`. A key with * or ? stands for all materials that match it.
    without_uv : collection of str
        Materials whose objects have no texture coordinates.

    Raises
    ------
    UserError
        If a material is unknown or has no texture coordinates, or its value is neither a material with textures nor a
        readable image.
    """
    found: dict[str, Look] = {}
    for pattern, value in wanted.items():
        of = texture_named(value, textures, Path, FIELD)
        alike = [name for name in looks if fnmatchcase(name, pattern)]
        for name in alike or [known("material", pattern, looks, field=FIELD)]:
            if of and name in without_uv:
                raise UserError(NO_UV, field=FIELD, got=name, hint=NO_UV_HINT)
            found[name] = with_texture(looks[name], of, looks, diffuse_textures(textures))
    return found


def with_texture(look: Look, of: str | ImageTexture, looks: Mapping[str, Look], coloured: Collection[str]) -> Look:
    """A look with another texture; the texture's mean becomes the diffuse colour, as far as lobes leave light for it.

    `looks` has the material `of` as loaded, and `coloured` the names of those whose textures have a diffuse part: other
    textures leave the colour as it is.
    """
    if isinstance(of, ImageTexture):
        kd: Triple | None = mean_and_detail(Path(of.file)).mean
    else:
        kd = looks[of].material.kd if of in coloured else None
    material = look.material
    if kd is not None:
        material = material.model_copy(update={"kd": possible_kd(material, kd)})
    return replace(look, material=material, textures=of)


def diffuse_textures(textures: Mapping[str, MaterialTextures]) -> frozenset[str]:
    """Names of the materials whose textures have a diffuse part."""
    return frozenset(name for name, one in textures.items() if one.diffuse is not None)


def texture_named(
    value: str, textures: Collection[str], locate: Callable[[str], Path], field: str, file: Path | None = None
) -> str | ImageTexture:
    """The texture of a text FILE[,REPEAT], a material with textures, or "none", which is the empty name.

    `locate` finds an image by its name as written; `field` and `file` are the text's place, for errors.
    """
    if value == NONE:
        return ""
    if value in textures:
        return value
    name, comma, number = value.rpartition(",")
    repeated = bool(comma) and is_number(number.strip())
    name, repeat = (name, float(number)) if repeated else (value, 1.0)
    image = locate(name)
    if not image.exists():
        expected = ", ".join([*sorted(textures), NONE, "or an image file"])
        fault = "is neither a material with textures nor a file"
        raise UserError(fault, file=file, field=field, got=value, expected=expected)
    if not 1 / MOST_REPEAT <= repeat <= MOST_REPEAT:  # also refuses nan
        expected = f"{1 / MOST_REPEAT:g} to {MOST_REPEAT:g}"
        raise UserError("repetition is out of range", file=file, field=field, got=repeat, expected=expected)
    return ImageTexture(str(image.resolve()), repeat)


def materials_without_uv(objects: Sequence[tuple[str, Floats]]) -> frozenset[str]:
    """Materials of which no object has texture coordinates; `objects` are the material and uv (n, 2) of each."""
    placed = {name for name, uv in objects if len(uv) and bool(np.ptp(uv, axis=0).any())}
    return frozenset(name for name, _ in objects) - placed
