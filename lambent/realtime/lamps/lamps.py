"""Lamps at points on the GPU: their records, shadow maps and profiles, and the texels that they reach."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.structs import LAMP_DTYPE
from lambent.realtime.gpu.uploads import upload
from lambent.realtime.lamps.drawn import DrawnLamps
from lambent.store.lamps import MOST_LAMPS


class PointLamps:
    """Bindings of lamps for the shaders of light, and constants of their pipelines; no lamps without `drawn`."""

    def __init__(self, layouts: Layouts, drawn: DrawnLamps | None) -> None:
        self._drawn, self._queue = drawn, layouts.device.queue
        self._records = layouts.uniform(MOST_LAMPS * LAMP_DTYPE.itemsize)
        self.constants = {"LAMPS": 0 if drawn is None else len(drawn.records)}
        reached = np.zeros(4, np.uint32) if drawn is None else drawn.reached
        discs = np.zeros((1, 1, 1), np.float16) if drawn is None else np.concatenate([drawn.distances, drawn.profiles])
        texture = upload(layouts.device, [discs[..., None]], "r16float")
        stored = layouts.buffer("STORAGE", reached)
        self.bindings = self._records, stored, texture.create_view(dimension="2d-array")
        self._in_map: list[Floats] = []
        if drawn is not None:
            self.shine(None, drawn.in_map())

    def taken_out(self, side: int, texels: NDArray[np.float16]) -> NDArray[np.float16]:
        """A layer (H, W, 4) of the light map: sides without the direct light of the lamps, others as they are."""
        if side >= len(self._in_map):
            return texels
        found = texels.astype(np.float32)
        found[..., :3] -= self._in_map[side]
        return np.maximum(found, 0).astype(np.float16)

    def shine(self, factors: Floats | None, in_map: list[Floats]) -> None:
        """Shine in a mix of light groups: factors (G, 3) or None as baked, and `DrawnLamps.in_map` of it."""
        if self._drawn is None:
            return
        self._in_map = in_map
        data = np.zeros(MOST_LAMPS, LAMP_DTYPE)
        lamps = self._drawn.records
        for row, lamp, intensity in zip(data, lamps, self._drawn.intensities(factors), strict=False):
            row["place"] = *lamp.position, np.sin(np.radians(lamp.reach_deg) / 2)
            row["across"][:3], row["down"][:3] = lamp.axes[:2]
            row["along"], row["intensity"][:3] = (*lamp.axes[2], lamp.profile), intensity
        self._queue.write_buffer(self._records, 0, data.tobytes())
