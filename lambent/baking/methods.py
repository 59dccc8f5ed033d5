"""Methods that a bake can choose from; the first of each is the default."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

from lambent.core.discovery import known
from lambent.core.errors import UserError

METHODS = "ways"  # document: the methods of the store's bake


class LightMapMethod(StrEnum):
    """The integrator of the light map."""

    paths = "paths"
    photons = "photons"


class ProbeMethod(StrEnum):
    """Whether surfaces seen by probes show the light map, or every path is traced to its end."""

    cached = "cached"
    traced = "traced"


class LightGroupMethod(StrEnum):
    """Whether light is separated by the group of its emitter (`scenes.light_groups`)."""

    none = "none"
    scene = "scene"


_CHOICES: dict[str, type[StrEnum]] = {
    "light_map": LightMapMethod, "probes": ProbeMethod, "light_groups": LightGroupMethod,
}  # fmt: skip


def chosen(before: Mapping[str, str], **wanted: str | None) -> dict[str, str]:
    """The method for each of `_CHOICES`: the wanted one, else that of `before`, else the default.

    Raises
    ------
    UserError
        If there is no such method.
    """
    found = {}
    for name, methods in _CHOICES.items():
        method = wanted.get(name) or before.get(name) or next(iter(methods))
        found[name] = methods(known(f"method to bake {name}", method, list(methods))).value
    return found


def check_groups(methods: Mapping[str, str]) -> None:
    """Raise `UserError` if light is to be separated by a method that cannot."""
    if sorts_light(methods) and methods["light_map"] == LightMapMethod.photons:
        hint = "bake with --light-map paths, or with --light-groups none"
        raise UserError("photons cannot be stored by light group", field="--light-groups", got="scene", hint=hint)


def sorts_light(methods: Mapping[str, str]) -> bool:
    """Whether these methods store light by group."""
    return methods.get("light_groups") == LightGroupMethod.scene
