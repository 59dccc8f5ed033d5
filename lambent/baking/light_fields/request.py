"""Which objects a bake is asked to give a light field: those of the scene, others, none, or those that it chooses."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from lambent.core.errors import UserError, did_you_mean
from lambent.scenes.scene import LightFieldWish, Scene
from lambent.store.contract import LIGHT_FIELD_CHOICE, light_field_name
from lambent.store.store import Artefact, Store

AS_SCENE, AUTO, NONE = "scene", "auto", "none"
BUDGET_MB = 256.0  # of the light fields that a bake chooses, as they lie in a renderer's memory
FIELDS, MEGABYTES = "light_fields", "light_field_mb"  # what a store notes of them among its methods


def noted(before: Mapping[str, Any], asked: str | None, budget_mb: float | None) -> dict[str, str]:
    """What a store notes: what is asked, else what was `before`, else what the scene says."""
    budget = before.get(MEGABYTES, BUDGET_MB) if budget_mb is None else budget_mb
    return {FIELDS: before.get(FIELDS, AS_SCENE) if asked is None else asked, MEGABYTES: str(budget)}


def as_asked(scene: Scene, asked: str) -> Scene:
    """The scene with light fields for the objects that are asked for.

    Parameters
    ----------
    asked : str
        "scene", "auto": those that the scene names; "none"; or patterns over names of objects, with commas between.
        An object that the scene names too gets what the scene says of it.

    Raises
    ------
    UserError
        Where a pattern fits no object.
    """
    if asked in (AS_SCENE, AUTO):
        return scene
    fields = dict[str, LightFieldWish]()
    names = [o.name for o in scene.objects]
    for pattern in asked.split(",") if asked != NONE else ():
        fits = [name for name in names if name == pattern or fnmatchcase(name, pattern)]
        if not fits:
            said, hint = f"names of objects, {AUTO}, {NONE} or {AS_SCENE}", did_you_mean(pattern, names)
            raise UserError("matches no object", field="--light-fields", got=pattern, expected=said, hint=hint)
        fields |= {name: scene.light_fields.get(name, LightFieldWish()) for name in fits}
    return replace(scene, light_fields=fields)


def light_fields_of(store: Store) -> list[dict[str, Any]]:
    """Of each light field of a store: object, points, megabytes in memory, seconds of the bake.

    Those that the bake has chosen have the errors that it found, `probe_error` and `error`: see `choice.Chosen`.
    """
    said = store.documents.get(LIGHT_FIELD_CHOICE, {}).get("chosen", ())
    tried = {one["object"]: {name: one[name] for name in ("probe_error", "error")} for one in said}
    by_object: dict[str, list[Artefact]] = defaultdict(list)
    for artefact in store.artefacts("light_field"):
        by_object[artefact.name.split("/", 1)[1].rsplit("/", 1)[0]].append(artefact)
    return [
        {
            "object": name,
            "points": max(a.shape[0] for a in arrays if a.name == light_field_name(name, "points")),
            "megabytes": sum(math.prod(a.shape) * np.dtype(a.dtype).itemsize for a in arrays) / 1e6,
            "seconds": max(a.meta.get("seconds", 0.0) for a in arrays),
            **tried.get(name, {}),
        }
        for name, arrays in by_object.items()
    ]
