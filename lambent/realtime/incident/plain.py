"""Distant light: the probe is read in the direction itself."""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.realtime.light.baked import Probe

NAME, COST, PREFERENCE = "plain", 0, 0
BINDINGS: tuple[str, ...] = ()


def serves(probe: Probe) -> bool:
    return True


def distances(probe: Probe, w: Floats) -> Floats:
    return np.full(len(w), np.inf)


def constants(device: Any, probe: Probe) -> dict[str, int]:
    return {}


def resources(device: Any, probe: Probe, streams: list[Any]) -> tuple[Any, ...]:
    return ()
