"""Keyframes of a film: states of materials and of the light mix over time, from a file beside a store."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from lambent.core.discovery import known
from lambent.core.errors import UserError, invalid
from lambent.core.inputs import foreign_bytes
from lambent.core.light.light_mix import AS_BAKED, GroupMix, LightMix, MixTrack
from lambent.scenes.loaders.scene_files import SceneFiles
from lambent.scenes.loaders.scene_toml.looks import parse_looks, parse_mixes
from lambent.scenes.loaders.scene_toml.material_files import LookFiles
from lambent.scenes.loaders.scene_toml.sections import NotNegative, Section
from lambent.scenes.loaders.scene_toml.text import toml_of
from lambent.scenes.looks.look_track import LookTrack
from lambent.scenes.looks.variants import variant_named
from lambent.scenes.scene import Look, Variant

MOST_KEYS = 1000


class _Key(Section):
    """One moment: all as baked, or as in a variant, or the light as saved with a view; then overrides by name."""

    at: NotNegative
    as_baked: bool = False
    variant: str | None = None
    view: str | None = None
    materials: dict[str, dict[str, Any]] = Field(default_factory=dict)
    light: dict[str, str | NotNegative] = Field(default_factory=dict)


class _Document(Section):
    format: Literal["lambent-keyframes"]
    version: Literal[1]
    keys: Annotated[tuple[_Key, ...], Field(min_length=1, max_length=MOST_KEYS)]


@dataclass(frozen=True)
class Known:
    """Names that keyframes may use: looks of the store's materials, its variants, and mixes saved with views.

    `coloured` tells whether textures have a diffuse part, by the material they belong to.
    """

    looks: Mapping[str, Look]
    variants: tuple[Variant, ...] = ()
    mixes: Mapping[str, LightMix] | None = None
    coloured: Mapping[str, bool] = field(default_factory=dict)


@dataclass(frozen=True)
class Keyframes:
    """Changes over time: the light mix, and materials."""

    light: MixTrack
    looks: LookTrack


@dataclass(frozen=True)
class _Moment:
    """A key before resolution: `whole_looks` and `whole_light` tell whether anything it does not name is as baked."""

    at: float
    looks: dict[str, Look]
    light: dict[str, GroupMix]
    whole_looks: bool
    whole_light: bool


def read_keyframes(path: Path, names: Known) -> Keyframes:
    """Read the keyframes of a file.

    Each material and each light group has its own keys: a key that does not name one lets it change from the previous
    to the next key that does. A key with a variant, or with `as_baked`, names all of them; one with a view, all light.

    Raises
    ------
    UserError
        If the file is damaged, uses unknown names, or its times do not increase.
    """
    with foreign_bytes("keyframes", path):
        try:
            document = _Document.model_validate(toml_of(path))
        except ValidationError as error:
            raise invalid(error, path, {*_Key.model_fields, *_Document.model_fields}) from error
    for first, second in pairwise(document.keys):
        if second.at <= first.at:
            raise UserError("times do not increase", file=path, field="keys.at", got=f"{first.at:g}, {second.at:g}")
    files = LookFiles(path, SceneFiles(path))
    moments = [_moment(key, number, names, files) for number, key in enumerate(document.keys)]
    return Keyframes(MixTrack(_light_keys(moments)), LookTrack(_look_keys(moments, names.looks)))


def _moment(key: _Key, number: int, names: Known, files: LookFiles) -> _Moment:
    path, where = files.path, f"keys.{number}"
    if sum((key.as_baked, key.variant is not None)) > 1:
        raise UserError("sets both as_baked and a variant", file=path, field=where, got=key.variant)
    looks, light = dict[str, Look](), dict[str, GroupMix]()
    if key.variant is not None:
        variant = variant_named(names.variants, key.variant, f"{path.name}: {where}.variant")
        looks, light = dict(variant.looks), dict(variant.light.groups)
    if key.view is not None:
        light = dict((names.mixes or {})[_known_view(key.view, names, path, where)].groups)
    present = {**names.looks, **looks}
    looks |= parse_looks(key.materials, present, names.coloured, files, f"{where}.materials")
    light |= parse_mixes(key.light, path, f"{where}.light")
    whole = key.as_baked or key.variant is not None
    return _Moment(key.at, looks, light, whole, whole or key.view is not None)


def _known_view(name: str, names: Known, path: Path, where: str) -> str:
    if not names.mixes:
        hint = "save a view in the window with its light mix"
        raise UserError("no saved view has a light mix", file=path, field=f"{where}.view", hint=hint)
    return known("saved view", name, names.mixes, file=path, field=f"{where}.view")


def _light_keys(moments: list[_Moment]) -> dict[str, tuple[tuple[float, GroupMix], ...]]:
    names = dict.fromkeys(name for moment in moments for name in moment.light)
    return {
        name: tuple((m.at, m.light.get(name, AS_BAKED)) for m in moments if m.whole_light or name in m.light)
        for name in names
    }


def _look_keys(moments: list[_Moment], loaded: Mapping[str, Look]) -> dict[str, tuple[tuple[float, Look], ...]]:
    names = dict.fromkeys(name for moment in moments for name in moment.looks)
    return {
        name: tuple((m.at, m.looks.get(name, loaded[name])) for m in moments if m.whole_looks or name in m.looks)
        for name in names
    }
