"""Offset surface light fields: light recorded at points just above the object, through whose maps rays march.

Source: thesis R, "Offset surface light fields"; the march is that of `baked.light_fields.lookup`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import wgpu

from lambent.baked.light_fields.light_field import NO_POINT
from lambent.baked.light_fields.lookup import EDGE_STEEPNESS, March
from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.geometry.cubemap import sample
from lambent.realtime.gpu.cube_mips import finite, mip_chain
from lambent.realtime.gpu.structs import LIGHT_FIELD_DTYPE, Record
from lambent.realtime.gpu.uploads import cube_texture, upload
from lambent.realtime.light.baked import BakedScene, Probe
from lambent.realtime.light_fields.light_field_atlas import Atlas, coding
from lambent.realtime.light_fields.resident_maps import ResidentMaps, filled


@dataclass(frozen=True)
class LightFieldLookUp:
    """The march, or with `CHOICE` a picture of the points that it uses; `incident.LookUp` describes the members."""

    NAME: str
    COST: int
    PREFERENCE: int
    CHOICE: bool = False
    BINDINGS: tuple[str, ...] = ("uniform", "exact", "layers", "number layers", "numbers", "cube")
    __file__: str = __file__

    def serves(self, probe: Probe) -> bool:
        return probe.light_field is not None and bool((probe.light_field.sample_map != NO_POINT).any())

    def distances(self, probe: Probe, w: Floats) -> Floats:
        return np.full(len(w), np.inf)

    def constants(self, device: Any, probe: Probe) -> dict[str, float]:
        rule, light_field = March(), probe.light_field
        return {
            "CHOICE": self.CHOICE, "STEPS": rule.steps, "SECANTS": rule.secants, "FIRST": rule.first,
            "LAST": rule.last, "TOLERANCE": rule.tolerance, "ALIKE": rule.alike, "STEEPNESS": EDGE_STEEPNESS,
            "HAS_SKY": probe.sky is not None,
            "GLASS": light_field is not None and light_field.glass is not None,
            "QUARTERS": light_field is not None and light_field.cover is not None,
            "BLOCKS": coding(device).block > 1,
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
    LightFieldLookUp("light_field", 20, PREFERENCE=3), LightFieldLookUp("light_field-choice", 21, -1, CHOICE=True)
)  # fmt: skip


def check_serves(scene: BakedScene, wanted: str, store: str) -> None:
    """Raise `UserError` if the wanted look-up is one of light fields and the scene has none."""
    look_up = next((one for one in LOOK_UPS if wanted == one.NAME), None)
    if look_up is not None and not scene.light_fields:
        hint = f"`lambent bake SCENE -o {store} --light-fields NAME,...` makes some"
        raise UserError("the store has no light field", field="--lookup", got=wanted, hint=hint)
