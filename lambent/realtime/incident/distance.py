"""The probe's distance map: a direction is marched to where it meets what the probe sees."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.colour import HALF_MAX
from lambent.core.cubemap import face_directions
from lambent.realtime.baked import Probe
from lambent.realtime.uploads import cube_texture

NAME, COST, PREFERENCE, AIMS = "distance", 2, 1, False  # its mapping of directions is not one to one
BINDINGS = ("cube",)


def serves(probe: Probe) -> bool:
    return probe.distance is not None


def constants(probe: Probe) -> dict[str, int]:
    return {}


def resources(device: Any, probe: Probe) -> tuple[Any, ...]:
    assert probe.distance is not None, "this look-up does not serve the probe"
    return (cube_texture(device, [inverse_depth(probe.distance)], "r16float").create_view(dimension="cube"),)


def inverse_depth(distance: NDArray[np.floating]) -> NDArray[np.floating]:
    """(6, N, N, 1): 1/max(|x|, |y|, |z|) of the points at `distance` (6, N, N) along each texel; linear over planes."""
    length = np.linalg.norm(face_directions(distance.shape[1]), axis=-1)
    safe = np.clip(np.nan_to_num(distance, nan=HALF_MAX, posinf=HALF_MAX), 1e-3, HALF_MAX)
    return np.asarray(length / safe)[..., None]
