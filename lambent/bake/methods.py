"""Methods between which a bake can choose; the first of each is the default."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

from lambent.core.discovery import known

METHODS = "ways"  # document: the methods that a store was baked with


class LightMapMethod(StrEnum):
    """The integrator of the light map."""

    paths = "paths"
    photons = "photons"


class ProbeMethod(StrEnum):
    """Whether surfaces seen by probes show the light map, or every path is traced to its end."""

    cached = "cached"
    traced = "traced"


def chosen(before: Mapping[str, str], **wanted: str | None) -> dict[str, str]:
    """The methods for `light_map` and `probes`: those wanted, else those of `before`, else the defaults.

    Raises
    ------
    UserError
        Where there is no such method.
    """
    found = {}
    for name, methods in {"light_map": LightMapMethod, "probes": ProbeMethod}.items():
        method = wanted[name] or before.get(name) or next(iter(methods))
        found[name] = methods(known(f"method to bake {name}", method, list(methods))).value
    return found
