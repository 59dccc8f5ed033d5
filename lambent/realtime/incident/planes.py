"""Bounding planes: a direction ends at the nearest of the planes around the object (thesis M, 4.4.1)."""

from __future__ import annotations

from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.baked.probes.lookups import distances_to_planes
from lambent.core.arrays import Floats
from lambent.realtime.light.baked import Probe

NAME, COST, PREFERENCE = "planes", 1, 2
BINDINGS = ("storage",)
STEP = 6  # plane counts are padded to multiples of this, because each count needs its own pipeline


def serves(probe: Probe) -> bool:
    return len(probe.planes) > 0


def distances(probe: Probe, w: Floats) -> Floats:
    planes = about_centre(probe).astype(np.float64)
    return distances_to_planes(w, planes)


def constants(device: Any, probe: Probe) -> dict[str, int]:
    return {"PLANES": padded_count(probe)}


def resources(device: Any, probe: Probe, streams: list[Any]) -> tuple[Any, ...]:
    return (device.create_buffer_with_data(data=about_centre(probe), usage=wgpu.BufferUsage.STORAGE),)


def padded_count(probe: Probe) -> int:
    return -(-len(probe.planes) // STEP) * STEP


def about_centre(probe: Probe) -> NDArray[np.float32]:
    """(P, 4) planes (n, n.c + d) about the probe's centre c, P a multiple of STEP."""
    planes = np.asarray(probe.planes, np.float32)
    padded = np.zeros((padded_count(probe), 4), np.float32)  # a zero plane is never approached
    padded[: len(planes)] = planes
    padded[: len(planes), 3] += planes[:, :3] @ np.asarray(probe.centre, np.float32)
    return padded
