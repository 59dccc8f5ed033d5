"""Light groups: emitters of a scene that are dimmed and coloured together.

A scene names groups (`Scene.light_groups`); an emitter belongs to the first that lists it. All other emitters are in
default groups: the sun, the sky, and lights and emitting objects by the stem of their name, so that "lamp_1" and
"lamp.002" form one group. With more than MOST_GROUPS, the weakest lamps are merged into a group "others".
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np

from lambent.core.geometry.triangles import triangle_areas
from lambent.core.light.colour import luminance
from lambent.core.plain import Triple
from lambent.scenes.scene import DirectionalLight, IesLight, Light, LightGroup, PointLight, Scene, SunSky

SUN, SKY, OTHERS = "sun", "sky", "others"
MOST_GROUPS = 8
_NUMBER = re.compile(r"[\s._-]*\d+$")


@dataclass(frozen=True)
class SortedLights:
    """The groups of a scene with the names of their members, and the group index of each emitter.

    `of_lights` has one index for each of `Scene.lights`, `of_objects` one by name for each object that emits; `sun` and
    `sky` are None if the scene has none.
    """

    groups: tuple[LightGroup, ...]
    of_lights: tuple[int, ...]
    of_objects: dict[str, int]
    sun: int | None
    sky: int | None


@dataclass(frozen=True)
class _Emitter:
    """`names` that may list it, the first one displayed; `power` in any unit, infinite for one that is never merged."""

    names: tuple[str, ...]
    usual: str  # its default group
    power: float


def sorted_lights(scene: Scene, suns: Collection[int] = (), *, sun_in_sky: bool = False) -> SortedLights:
    """The groups of a scene's emitters.

    Parameters
    ----------
    suns : collection of int
        Indices of the directional lights that are the sun.
    sun_in_sky : bool
        Whether the sun is a part of the environment.
    """
    lights = [
        _of_light(light, name, number in suns)
        for number, (light, name) in enumerate(zip(scene.lights, names_of_lights(scene.lights), strict=True))
    ]
    shining = [o for o in scene.objects if any(o.emission) and o.luminaire is None]
    objects = [
        _Emitter(
            (whole := scene.parts.get(o.name, o.name), o.name), stem(whole),
            math.pi * float(triangle_areas(o.mesh.corners).sum()) * _bright(o.emission),
        )
        for o in shining
    ]  # fmt: skip
    far = [_Emitter((SUN,), SUN, math.inf)] if sun_in_sky else []
    far += [] if scene.environment is None else [_Emitter((SKY,), SKY, math.inf)]
    emitters = [*far, *lights, *objects]
    chosen = _named(emitters, scene.light_groups)
    order = list(dict.fromkeys([*(g.name for g in scene.light_groups if g.name in chosen), *chosen]))
    members = [tuple(dict.fromkeys(e.names[0] for e, c in zip(emitters, chosen, strict=True) if c == g)) for g in order]
    numbers = [order.index(name) for name in chosen]
    first = len(far)
    of_lights = tuple(numbers[first : first + len(lights)])
    of_objects = {o.name: n for o, n in zip(shining, numbers[first + len(lights) :], strict=True)}
    of_objects |= {name: of_lights[number] for number, name in scene.openings.items()}
    sky = None if scene.environment is None else numbers[len(far) - 1]
    sun = numbers[0] if sun_in_sky else next((of_lights[number] for number in sorted(suns)), None)
    return SortedLights(tuple(map(LightGroup, order, members)), of_lights, of_objects, sun, sky)


def groups_before_bake(scene: Scene) -> tuple[LightGroup, ...]:
    """The groups of a scene before its bake, when a sun in a picture of the environment is not yet known."""
    suns = [n for n, light in enumerate(scene.lights) if isinstance(light, DirectionalLight) and any(light.irradiance)]
    shines = isinstance(scene.environment, SunSky) and scene.environment.sun_scale > 0
    return sorted_lights(scene, () if shines else suns[:1], sun_in_sky=shines).groups


def names_of_lights(lights: Iterable[Light]) -> list[str]:
    """Names of a scene's lights; unnamed ones are named by kind and number."""
    found, count = [], Counter[str]()
    for light in lights:
        kind = _kind(light)
        count[kind] += not light.name
        found.append(light.name or f"{kind} {count[kind]}")
    return found


def stem(name: str) -> str:
    """A name without trailing numbers; the whole name if nothing else is left."""
    while (shorter := _NUMBER.sub("", name)) and shorter != name:
        name = shorter
    return name


def _kind(light: Light) -> str:
    if isinstance(light, IesLight):
        return "luminaire"
    if isinstance(light, DirectionalLight):
        return "directional"
    return "point" if light.direction is None else "spot"


def _of_light(light: Light, name: str, is_sun: bool) -> _Emitter:
    if is_sun:
        return _Emitter((SUN, name), SUN, math.inf)
    return _Emitter((name,), stem(name), _power(light))


def _power(light: Light) -> float:
    """Approximate total power of a light; for one that lights everything, as if on 10 m2."""
    if isinstance(light, DirectionalLight):
        return 10.0 * _bright(light.irradiance)
    if isinstance(light, IesLight):
        return light.photometry.lumens * _bright(light.scale)
    assert isinstance(light, PointLight)
    return 2 * math.pi * (1 - math.cos(math.radians(light.outer_deg))) * _bright(light.intensity)


def _bright(light: Triple) -> float:
    return float(luminance(np.array(light, float)))


def _named(emitters: Sequence[_Emitter], given: Sequence[LightGroup]) -> list[str]:
    """The name of each emitter's group."""
    listed = [next((g.name for g in given if _lists(g, emitter)), None) for emitter in emitters]
    chosen = [emitter.usual if name is None else name for emitter, name in zip(emitters, listed, strict=True)]
    kept = {name for name in listed if name is not None}
    power = dict.fromkeys(chosen, 0.0)
    for emitter, name in zip(emitters, chosen, strict=True):
        power[name] += emitter.power
    usual = sorted((name for name in power if name not in kept), key=lambda name: -power[name])
    room = MOST_GROUPS - len(kept)
    kept |= set(usual if len(usual) <= room else usual[: max(room - 1, 0)])
    return [name if name in kept else OTHERS for name in chosen]


def _lists(group: LightGroup, emitter: _Emitter) -> bool:
    return any(name == member or fnmatchcase(name, member) for member in group.members for name in emitter.names)
