"""Offset surface light fields: light recorded at points just above the object; look-ups read the nearest points.

Source: thesis R, "Offset surface light fields"; methods as in `core.light_field_lookup`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import wgpu

from lambent.core.arrays import Floats
from lambent.core.cubemap import sample
from lambent.core.errors import UserError
from lambent.core.light_field import NO_POINT
from lambent.core.light_field_lookup import EDGE_STEEPNESS, POWER, March
from lambent.realtime.baked import DARK, BakedScene, Probe
from lambent.realtime.cube_mips import finite, mip_chain
from lambent.realtime.light_field_atlas import Atlas, coding
from lambent.realtime.resident_maps import ResidentMaps, filled
from lambent.realtime.structs import LIGHT_FIELD_DTYPE, Record
from lambent.realtime.uploads import cube_texture, upload

# Methods to blend or find the light of the points, by the shader's numbers.
NEAREST, ANGLE, AVERAGE, TOWARDS_RAY, TOWARDS_NORMAL, MARCHED, CHOSEN = range(7)


@dataclass(frozen=True)
class LightFieldLookUp:
    """One method; `incident.LookUp` describes the members."""

    NAME: str
    METHOD: int
    COST: int
    PREFERENCE: int = -1
    RULE: March = field(default_factory=March)
    POWER: int = POWER  # exponent of the cosines that weight points
    SURFACE: bool = False  # whether points also replace the object's light map
    BINDINGS: tuple[str, ...] = ("uniform", "exact", "layers", "number layers", "numbers", "cube")
    __file__: str = __file__

    def serves(self, probe: Probe) -> bool:
        field = probe.light_field
        if field is None or (self.SURFACE and not field.own_diffuse):
            return False
        return bool((field.sample_map != NO_POINT).any())

    def distances(self, probe: Probe, w: Floats) -> Floats:
        return np.full(len(w), np.inf)

    def constants(self, device: Any, probe: Probe) -> dict[str, float]:
        light_field = probe.light_field
        maps = {
            "GLASS": light_field is not None and light_field.glass is not None,
            "QUARTERS": light_field is not None and light_field.cover is not None,
            "BLOCKS": coding(device).block > 1,
        }
        if self.METHOD < MARCHED:
            return {"METHOD": self.METHOD, "POWER": self.POWER, **maps}
        rule = self.RULE
        return {
            "METHOD": self.METHOD, "POWER": self.POWER, "MARCHES": rule.candidates, "STEPS": rule.steps,
            "SECANTS": rule.secants, "FIRST": rule.first, "LAST": rule.last, "TOLERANCE": rule.tolerance,
            "ALIKE": rule.alike, "STEEPNESS": EDGE_STEEPNESS, "HAS_SKY": probe.sky is not None, "SURFACE": self.SURFACE,
            **maps,
        }  # fmt: skip

    def resources(self, device: Any, probe: Probe, streams: list[Any]) -> tuple[Any, ...]:
        light_field = probe.light_field
        assert light_field is not None, "this look-up does not apply to the probe"
        sky = np.zeros((6, 1, 1, 3), np.float32) if probe.sky is None else finite(probe.sky)[0]
        maps = ResidentMaps(device, light_field, probe.most_bytes, probe.policy, lambda w: sample(sky, w))
        if not maps.whole:
            streams.append(maps)
        atlas = maps.atlas
        record = np.zeros((), LIGHT_FIELD_DTYPE)
        _put_layout(record, atlas)
        record["corner"], record["grid"] = light_field.corner[::-1], light_field.grid[::-1]
        record["sky_texels"] = np.log2(sky.shape[1] / 2)
        texels = filled(light_field.sample_map)
        if (glass := light_field.glass) is not None:
            record["tint"], record["eta"], record["power"] = glass.tint, glass.eta, glass.power
            texels = np.concatenate([texels, glass.exits.astype(np.float16).view(np.uint16)])
        numbers = upload(device, [texels[None]], "rgba16uint")
        return (
            device.create_buffer_with_data(data=record.tobytes(), usage=wgpu.BufferUsage.UNIFORM),
            maps.points.create_view(),
            atlas.radiance.create_view(dimension="2d-array"),
            atlas.distances.create_view(dimension="2d-array"),
            numbers.create_view(),
            cube_texture(device, mip_chain(sky)).create_view(dimension="cube"),
        )


def _put_layout(record: Record, atlas: Atlas) -> None:
    """Write the layout of the maps."""
    tiles, layout = atlas.tiles, atlas.layout
    levels = range(1, len(tiles.sides))
    record["side"], record["tile"], record["levels"] = tiles.sides[0], tiles.tiles[0], len(tiles.sides)
    record["places"], record["size"], record["cell"] = layout.places, layout.size[:2], atlas.cell
    record["coarse"][: len(levels)] = tiles.tiles[1:]
    record["coarse_row"][: len(levels)] = [layout.first_row(level) for level in levels]


LOOK_UPS = (
    LightFieldLookUp("light_field", MARCHED, 20, PREFERENCE=3),
    LightFieldLookUp("light_field-1", MARCHED, 19, RULE=March(candidates=1)),
    LightFieldLookUp("light_field-nearest", NEAREST, 10),
    LightFieldLookUp("light_field-angle", ANGLE, 11),
    LightFieldLookUp("light_field-average", AVERAGE, 12),
    LightFieldLookUp("light_field-br", TOWARDS_RAY, 13),
    LightFieldLookUp("light_field-bn", TOWARDS_NORMAL, 14),
    LightFieldLookUp("light_field-choice", CHOSEN, 21),
    LightFieldLookUp("light_field-surface", MARCHED, 22, SURFACE=True),
)


def check_serves(scene: BakedScene, wanted: str, store: str) -> None:
    """Raise `UserError` if the wanted look-up is one of light fields and serves no object of the scene."""
    look_up = next((one for one in LOOK_UPS if wanted == one.NAME), None)
    if look_up is None:
        return
    if not scene.light_fields:
        hint = f"`lambent bake SCENE -o {store} --light-fields NAME,...` makes some"
        raise UserError("the store has no light field", field="--lookup", got=wanted, hint=hint)
    if not any(look_up.serves(replace(DARK, light_field=one)) for one in scene.light_fields.values()):
        hint = "give the object `light_field = { levels = 1 }` in the scene, and bake"
        raise UserError("no light field has its object's own maps", field="--lookup", got=wanted, hint=hint)
