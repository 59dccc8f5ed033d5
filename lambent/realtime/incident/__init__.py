"""Look-ups of incident light: they map a direction at a surface to a direction of a probe. Files are found by name.

A look-up is a module with the members of `LookUp`, and a shader of the same name with
    fn incident_look_up(x: vec3f, w: vec3f) -> LookUp    look-up from x, about the probe's centre, along w
    fn incident_bound(x: vec3f, w: vec3f) -> f32         1 over the distance, in m, to the nearest known wall along w; 0
                                                         without one
incident.wgsl declares the type. Bindings of the look-up are in group 2, from 3 on. A look-up with its own
light, other than the probe's cube map, must also define all functions of incident_light.wgsl.
"""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path
from typing import Any, Protocol, cast

from lambent.core.arrays import Floats
from lambent.core.discovery import known, modules_in
from lambent.realtime.light.baked import Probe

AUTO = "auto"


class LookUp(Protocol):
    """Members of a look-up's module."""

    NAME: str  # on the command line and in the window
    COST: int  # relative; sorts lists
    PREFERENCE: int  # AUTO takes the look-up of highest preference that serves the probe
    BINDINGS: tuple[str, ...]  # kinds (`layouts.KINDS`) of its resources
    __file__: str

    def __hash__(self) -> int: ...

    def serves(self, probe: Probe) -> bool:
        """Whether the probe has the data that the look-up needs."""

    def distances(self, probe: Probe, w: Floats) -> Floats:
        """(M,) distance, m, from the probe's centre to known geometry along unit directions w (M, 3); else inf."""

    def constants(self, device: Any, probe: Probe) -> dict[str, int]:
        """Values of the shader's `override` constants."""

    def resources(self, device: Any, probe: Probe, streams: list[Any]) -> tuple[Any, ...]:
        """Buffers and texture views for the shader; maps that must follow the camera are appended to `streams`."""


def look_ups() -> dict[str, LookUp]:
    """All look-ups by name, cheapest first. A file may have several, in `LOOK_UPS`."""
    here = sys.modules[__name__]
    found = [cast(LookUp, module) for module in modules_in(here, having="NAME").values()]
    found += [one for module in modules_in(here, having="LOOK_UPS").values() for one in module.LOOK_UPS]
    return {look_up.NAME: look_up for look_up in sorted(found, key=lambda one: one.COST)}


def look_up_of(probe: Probe, wanted: str, among: dict[str, LookUp]) -> LookUp:
    """The look-up `wanted` if it serves the probe; else, and for AUTO, the preferred one that does."""
    known("look-up", wanted, (AUTO, *among))
    if wanted != AUTO and among[wanted].serves(probe):
        return among[wanted]
    return max((one for one in among.values() if one.serves(probe)), key=lambda one: one.PREFERENCE)


def shader_of(look_up: LookUp) -> str:
    """WGSL of a look-up."""
    return Path(look_up.__file__).with_suffix(".wgsl").read_text(encoding="utf-8")


@cache
def brings_light(look_up: LookUp) -> bool:
    """Whether a look-up has its own light, other than the probe's cube map."""
    return "fn incident(" in shader_of(look_up)


def included(look_up: LookUp) -> dict[str, str]:
    """Argument `given` of `shader_source.assemble` for a draw with this look-up."""
    own = {"incident_light.wgsl": ""} if brings_light(look_up) else {}
    return {"look_up.wgsl": shader_of(look_up), **own}
