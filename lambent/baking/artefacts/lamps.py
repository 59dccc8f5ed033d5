"""Lamps that renderers draw by pixel: see `store.lamps`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.ndimage import maximum_filter

from lambent.baking.artefacts.light_map import IRRADIANCE, SIGNS, lamps_apart, side_count
from lambent.baking.context import BakeContext
from lambent.baking.methods import sorts_light
from lambent.baking.running.keys import key_of
from lambent.core.plain import triple
from lambent.scenes.scene import IesLight, PointLight
from lambent.store.lamp_discs import axes_of, opening_of, profile, reach_deg
from lambent.store.lamps import DISTANCES, LAMPS, PROFILES, REACHED, SEEN, LampRecord

if TYPE_CHECKING:
    from numpy.typing import NDArray
KIND = "lamps"
NEEDS = ("geometry", "light_map")
REVISION = 3


def keys(context: BakeContext) -> dict[str, str]:
    if not lamps_apart(context):
        return {}
    key = key_of(KIND, REVISION, context.keys("light_map")[IRRADIANCE[0]], sorts_light(context.methods))
    return dict.fromkeys((PROFILES, DISTANCES, REACHED, SEEN, *LAMPS[: side_count(context)]), key)


def bake(context: BakeContext) -> None:
    from lambent.baking.light.lamp_maps import shadow_map

    traced, scene = context.traced, context.scene
    drawn = [traced.lamps[place] for place in traced.drawn_lamps]
    lamps = [light for light in (scene.lights[number] for number in drawn) if isinstance(light, PointLight | IesLight)]
    profiles, records = _records(context, drawn, lamps)
    context.put(KIND, PROFILES, profiles, context.provenance())
    size = traced.texels.height, traced.texels.width
    reached, shaded = np.zeros(size, np.uint64), np.zeros(size, np.uint64)
    seen = np.zeros(1, np.uint8)
    for side in range(side_count(context)):
        light = traced.lamp_light(SIGNS[side])
        of_map = light.drawn if sorts_light(context.methods) else light.drawn.sum(axis=0, keepdims=True)
        context.put(KIND, LAMPS[side], of_map, context.provenance())
        reached |= light.reached
        shaded |= light.sharp
        seen = np.maximum(seen, light.seen)
    bare, maps = traced.bare, []
    for number, lamp in enumerate(lamps):
        context.progress(number, len(lamps), "shadow maps of lamps")
        distances, behind = shadow_map(bare, lamp, size)
        maps.append(distances)
        if drawn[number] not in scene.openings:
            shaded |= maximum_filter(behind, 3).astype(np.uint64) << np.uint64(number)
    context.put(KIND, SEEN, seen, context.provenance())
    words = [part >> np.uint64(32 * word) for part in (reached, shaded) for word in (0, 1)]
    context.put(KIND, REACHED, np.stack(words, axis=-1).astype(np.uint32), context.provenance())
    stacked = np.stack(maps) if maps else np.zeros((0, 1, 1), np.float16)
    context.put(KIND, DISTANCES, stacked, context.provenance(lamps=records))


def _records(
    context: BakeContext, numbers: list[int], lamps: list[PointLight | IesLight]
) -> tuple[NDArray[np.float16], list[dict[str, Any]]]:
    """The profiles of lamps, equal ones once, and their records as JSON."""
    groups, grouped = context.traced.sorted_lights.of_lights, sorts_light(context.methods)
    known: dict[bytes, int] = {}
    profiles, records = list[Any](), []
    for number, lamp in zip(numbers, lamps, strict=True):
        shape, intensity = profile(lamp)
        if (place := known.setdefault(shape.tobytes(), len(profiles))) == len(profiles):
            profiles.append(shape)
        rows = [triple(axis) for axis in axes_of(lamp)]
        shown = next((o for o in context.scene.objects if o.luminaire == number), None)
        opening = {} if shown is None else opening_of(lamp) | {"moved": shown.moved}
        record = LampRecord(
            number=number, position=lamp.position, axes=(rows[0], rows[1], rows[2]), intensity=triple(intensity),
            reach_deg=reach_deg(lamp), profile=place, group=groups[number] if grouped else 0, **opening,
        )  # fmt: skip
        records.append(record.model_dump(mode="json"))
    return np.stack(profiles) if profiles else np.zeros((0, 1, 1), np.float16), records
