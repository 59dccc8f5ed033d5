"""Look-ups of incident light: where in a probe a direction at a surface finds its light. One file each, found by name.

A look-up is a module that has what `LookUp` lists, and beside it a shader of the same name with
    fn incident_look_up(x: vec3f, w: vec3f) -> LookUp    where to look from x, about the probe's centre, along w
    fn incident_bound(x: vec3f, w: vec3f) -> f32         1/m: 1 over the distance at which a wall that is known ends the
                                                         view along w; 0 where none is known
and, where samples can be aimed at lamps through it (AIMS),
    fn aim_maps(x: vec3f) -> bool                        whether that can be done at x
    fn aimed_look_up(x: vec3f, w: vec3f) -> Aimed        incident_look_up, and how densely the probe's directions lie
    fn aim_towards(x: vec3f, q: vec3f) -> Towards        the way back, from a direction q of the probe
The types are those of shaders/incident.wgsl. Bindings of its own are in group 2, from 3 on. A look-up whose light is
not that of the probe's cube map has besides all functions of shaders/incident_light.wgsl.
"""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path
from typing import Any, Protocol, cast

from lambent.core.arrays import Floats
from lambent.core.discovery import known, modules_in
from lambent.realtime.baked import Probe

AUTO = "auto"


class LookUp(Protocol):
    """What a module of this package has."""

    NAME: str  # as the command line and the window have it
    COST: int  # relative: lists go from cheap to dear
    PREFERENCE: int  # AUTO takes the look-up of the highest preference that serves a probe
    AIMS: bool  # whether samples can be aimed at the probe's lamps through it
    BINDINGS: tuple[str, ...]  # kinds (`layouts.KINDS`) of its resources
    __file__: str

    def __hash__(self) -> int: ...

    def serves(self, probe: Probe) -> bool:
        """Whether the probe has what the look-up needs."""

    def distances(self, probe: Probe, w: Floats) -> Floats:
        """(M,) metres from the probe's centre to what is known along unit directions w (M, 3); inf for nothing."""

    def constants(self, device: Any, probe: Probe) -> dict[str, int]:
        """Values of the shader's `override` constants."""

    def resources(self, device: Any, probe: Probe, streams: list[Any]) -> tuple[Any, ...]:
        """Buffers and views of textures that its shader reads; what of them follows the view joins `streams`."""


def look_ups() -> dict[str, LookUp]:
    """All look-ups by name, from cheap to dear. A file may have several, in `LOOK_UPS`."""
    here = sys.modules[__name__]
    found = [cast(LookUp, module) for module in modules_in(here, having="NAME").values()]
    found += [one for module in modules_in(here, having="LOOK_UPS").values() for one in module.LOOK_UPS]
    return {look_up.NAME: look_up for look_up in sorted(found, key=lambda one: one.COST)}


def look_up_of(probe: Probe, wanted: str, among: dict[str, LookUp]) -> LookUp:
    """The look-up `wanted` if it serves the probe, else, and for AUTO, the one of the highest preference that does."""
    known("look-up", wanted, (AUTO, *among))
    if wanted != AUTO and among[wanted].serves(probe):
        return among[wanted]
    return max((one for one in among.values() if one.serves(probe)), key=lambda one: one.PREFERENCE)


def shader_of(look_up: LookUp) -> str:
    """WGSL of a look-up."""
    return Path(look_up.__file__).with_suffix(".wgsl").read_text(encoding="utf-8")


@cache
def brings_light(look_up: LookUp) -> bool:
    """Whether its light is its own, not that of the probe's cube map."""
    return "fn incident(" in shader_of(look_up)


def included(look_up: LookUp) -> dict[str, str]:
    """What `shader_source.assemble` is given for a draw with that look-up."""
    own = {"incident_light.wgsl": ""} if brings_light(look_up) else {}
    return {"look_up.wgsl": shader_of(look_up), **own}
