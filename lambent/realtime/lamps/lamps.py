"""Lamps at points on the GPU: their records, profiles, shadow maps, and the texels that they reach."""

from __future__ import annotations

import numpy as np

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
        count = 0 if drawn is None else len(drawn.records)
        self.constants = {"LAMPS": count, "LAMP_AZIMUTHS": 1 if drawn is None else drawn.profiles.shape[1]}
        profiles = np.zeros(4, np.float32) if drawn is None else drawn.profiles
        reached = np.zeros(4, np.uint32) if drawn is None else drawn.reached
        distances = np.zeros((1, 1, 1), np.float16) if drawn is None else drawn.distances
        texture = upload(layouts.device, [distances[..., None]], "r16float")
        stored = (layouts.buffer("STORAGE", values) for values in (profiles, reached))
        self.bindings = self._records, *stored, texture.create_view(dimension="2d-array")
        self.shine()

    def shine(self, factors: Floats | None = None) -> None:
        """Shine in a mix of light groups with factors (G, 3) from now on; None: as baked."""
        if self._drawn is None:
            return
        data = np.zeros(MOST_LAMPS, LAMP_DTYPE)
        lamps = self._drawn.records
        for row, lamp, intensity in zip(data, lamps, self._drawn.intensities(factors), strict=False):
            row["place"] = *lamp.position, np.sin(np.radians(lamp.reach_deg) / 2)
            row["across"][:3], row["down"][:3] = lamp.axes[:2]
            row["along"], row["intensity"][:3] = (*lamp.axes[2], lamp.profile), intensity
        self._queue.write_buffer(self._records, 0, data.tobytes())
