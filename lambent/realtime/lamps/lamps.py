"""Lamps on the GPU: their records, shadow maps and profiles, and the texels that they reach."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.structs import LAMP_DTYPE
from lambent.realtime.gpu.uploads import upload, upload_layer
from lambent.realtime.lamps.drawn import DrawnLamps, ShadowedLamp
from lambent.store.lamps import MOST_LAMPS, LampRecord


class PointLamps:
    """Bindings of lamps for the shaders of light, and constants of their pipelines; no lamps without `drawn`."""

    def __init__(self, layouts: Layouts, drawn: DrawnLamps | None) -> None:
        self._drawn, self._device = drawn, layouts.device
        self._factors: Floats | None = None
        self._records = layouts.uniform(MOST_LAMPS * LAMP_DTYPE.itemsize)
        self.constants = {"LAMPS": 0 if drawn is None else len(drawn.records)}
        self._of_texels = np.zeros((1, 1, 1, 4), np.uint32) if drawn is None else of_texels(drawn)
        self._stored = layouts.buffer("STORAGE", self._of_texels)
        self.constants["LAMP_WORDS"] = self._of_texels.shape[2]
        self._changed: frozenset[int] = frozenset()
        self._profiles: list[NDArray[np.float16]] = []  # beyond those of `drawn`
        self._discs = self._uploaded_discs()
        self._in_map: list[Floats] = []
        if drawn is not None:
            self.shine(None, drawn.in_map())

    @property
    def bindings(self) -> tuple[Any, ...]:
        """The last resources of `layouts.LIGHT`."""
        return self._records, self._stored, self._view

    @property
    def records(self) -> tuple[LampRecord, ...]:
        """The lamps as they shine, in units of the scene."""
        return () if self._drawn is None else self._drawn.records

    def _uploaded_discs(self) -> Any:
        """Texture of shadow maps, and profiles of `drawn` and beyond."""
        discs = np.zeros((1, 1, 1), np.float16)
        if (drawn := self._drawn) is not None:
            discs = np.concatenate([drawn.distances, drawn.profiles, *(one[None] for one in self._profiles)])
        texture = upload(self._device, [discs[..., None]], "r16float", drawn_into=True)
        self._view = texture.create_view(dimension="2d-array")
        return texture

    def change(self, drawn: DrawnLamps, profiles: list[NDArray[np.float16]], places: frozenset[int]) -> bool:
        """Shine as the records of `drawn`, which may have these further profiles; return whether shadow maps are lost.

        At some `places` among the records, lamps are not as baked: their light may arrive anywhere.
        """
        self._drawn = drawn
        lost = len(profiles) != len(self._profiles) or not all(map(operator.is_, profiles, self._profiles))
        if lost:
            self._profiles = profiles
            self._discs = self._uploaded_discs()
        if places != self._changed:
            self._changed = places
            bits = np.zeros(4, np.uint32)
            for place in places:
                bits[[place // 32, 2 + place // 32]] |= np.uint32(1 << place % 32)
            changed = self._of_texels.copy()
            changed[:, :, 0] |= bits
            self._device.queue.write_buffer(self._stored, 0, changed)
        self.shine(self._factors, self._in_map)
        return lost

    def disc(self, place: int) -> Any:
        """View of the shadow map of a lamp, by its place among the records."""
        return self._discs.create_view(dimension="2d", base_array_layer=place, array_layer_count=1)

    def distances(self, place: int) -> NDArray[np.float16]:
        """(S, S) the shadow map of a lamp, m; waits for the GPU."""
        side = self._discs.size[0]
        source = {"texture": self._discs, "origin": (0, 0, place)}
        data = self._device.queue.read_texture(source, {"bytes_per_row": 2 * side}, (side, side, 1))
        return np.frombuffer(data, np.float16).reshape(side, side)

    def shadowed(self, place: int) -> ShadowedLamp:
        """A lamp as it shines; waits for the GPU."""
        record, own = self.records[place], self._drawn.profiles if self._drawn is not None else ()
        profile = [*own, *self._profiles][record.profile]
        return ShadowedLamp(record, profile, self.distances(place))

    def restore(self, place: int) -> None:
        """Show a lamp's shadow map as baked."""
        assert self._drawn is not None, "there are lamps"
        upload_layer(self._device, self._discs, place, self._drawn.distances[place])

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
        self._factors, self._in_map = factors, in_map
        data = np.zeros(MOST_LAMPS, LAMP_DTYPE)
        lamps = self._drawn.records
        places = np.cumsum([lamp.has_opening for lamp in lamps]) - 1  # in `DrawnLamps.seen`
        places[list(self._changed)] = -1
        each = zip(data, lamps, places, self._drawn.intensities(factors), strict=False)
        for row, lamp, place, intensity in each:
            row["place"] = *lamp.position, np.sin(np.radians(lamp.reach_deg) / 2)
            halves = zip(lamp.axes[:2], lamp.half_axes_m, strict=True)
            row["across"], row["down"] = ((*axis, half_m) for axis, half_m in halves)
            row["along"], row["intensity"] = (*lamp.axes[2], lamp.profile), (*intensity, place)
            row["faces"] = (*lamp.silhouettes_m2, lamp.is_box)
        self._device.queue.write_buffer(self._records, 0, data.tobytes())


def of_texels(drawn: DrawnLamps) -> NDArray[np.uint32]:
    """(H, W, rows, 4) by texel: `DrawnLamps.reached`, and visible shares of 16 openings in each further row."""
    count, height, width = drawn.seen.shape
    if not count:
        return drawn.reached[:, :, None]
    shares = np.zeros((height, width, 16 * (drawn.rows - 1)), np.uint8)
    shares[..., :count] = np.moveaxis(drawn.seen, 0, -1)
    return np.concatenate([drawn.reached[:, :, None], shares.view("<u4").reshape(height, width, -1, 4)], axis=2)
