"""The probe's distance map: marches along a direction to the surface that the probe sees."""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.baked.probes.lookups import inverse_depth
from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import sample
from lambent.core.light.colour import HALF_MAX
from lambent.realtime.gpu.uploads import cube_texture
from lambent.realtime.light.baked import Probe

NAME, COST, PREFERENCE = "distance", 2, 1
BINDINGS = ("cube",)


def serves(probe: Probe) -> bool:
    return probe.distance is not None


def distances(probe: Probe, w: Floats) -> Floats:
    assert probe.distance is not None, "this look-up does not apply to the probe"
    found = sample(probe.distance[..., None], w)[:, 0]
    return np.where(np.isfinite(found) & (found < HALF_MAX), found, np.inf)


def constants(device: Any, probe: Probe) -> dict[str, int]:
    return {}


def resources(device: Any, probe: Probe, streams: list[Any]) -> tuple[Any, ...]:
    assert probe.distance is not None, "this look-up does not apply to the probe"
    distance = np.minimum(np.nan_to_num(probe.distance, nan=HALF_MAX, posinf=HALF_MAX), HALF_MAX)
    return (cube_texture(device, [inverse_depth(distance)], "r16float").create_view(dimension="cube"),)
