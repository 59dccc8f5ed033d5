"""Exchange the textures of materials, by mean and detail: none, those of another material, or an image.

The exchanged texture brings its mean as the material's diffuse colour; lobes, and roughness where only an image is
exchanged, stay.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.plain import Triple, is_number
from lambent.materials.diffuse_albedos import possible_kd
from lambent.scenes.image_textures import MOST_REPEAT, mean_and_detail
from lambent.scenes.scene import ImageTexture, Look, MaterialTextures

FIELD = "--texture"
NONE = "none"


def parse_textures(texts: Sequence[str]) -> dict[str, str]:
    """What each material shall wear, from texts MATERIAL=FILE[,REPEAT], MATERIAL=MATERIAL or MATERIAL=none."""
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
        of = _source(value, textures)
        alike = [name for name in looks if fnmatchcase(name, pattern)]
        for name in alike or [known("material", pattern, looks, field=FIELD)]:
            if of and name in without_uv:
                raise UserError(
                    "has no texture coordinates",
                    field=FIELD,
                    got=name,
                    hint="bake the scene again, or add uv to its geometry",
                )
            kd = mean_of(of, looks, textures)
            material = looks[name].material
            if kd is not None:
                material = material.model_copy(update={"kd": possible_kd(material, kd)})
            found[name] = replace(looks[name], material=material, textures=of)
    return found


def mean_of(
    of: str | ImageTexture, looks: Mapping[str, Look], textures: Mapping[str, MaterialTextures]
) -> Triple | None:
    """The diffuse colour that a texture brings: its mean; None if it has none, and the colour stays."""
    if isinstance(of, ImageTexture):
        return mean_and_detail(Path(of.file)).mean
    return looks[of].material.kd if of and textures[of].diffuse is not None else None


def _source(value: str, textures: Mapping[str, MaterialTextures]) -> str | ImageTexture:
    if value == NONE:
        return ""
    if value in textures:
        return value
    file, comma, number = value.rpartition(",")
    repeated = bool(comma) and is_number(number.strip())
    file, repeat = (file, float(number)) if repeated else (value, 1.0)
    if not Path(file).exists():
        expected = ", ".join([*sorted(textures), NONE, "or an image file"])
        raise UserError("is neither a material with textures nor a file", field=FIELD, got=value, expected=expected)
    return ImageTexture(str(Path(file).resolve()), checked_repeat(repeat))


def checked_repeat(repeat: float) -> float:
    """The number of repetitions; `UserError` if it is out of range."""
    if not 1 / MOST_REPEAT <= repeat <= MOST_REPEAT:  # also refuses nan
        expected = f"{1 / MOST_REPEAT:g} to {MOST_REPEAT:g}"
        raise UserError("repetition is out of range", field=FIELD, got=repeat, expected=expected)
    return repeat


def materials_without_uv(worn: Sequence[tuple[str, Floats]]) -> frozenset[str]:
    """Materials of which no object has texture coordinates; `worn` has a material and its uv (n, 2) for each object."""
    placed = {name for name, uv in worn if len(uv) and bool(np.ptp(uv, axis=0).any())}
    return frozenset(name for name, _ in worn) - placed
