"""The direct light of moved, aimed and exchanged lamps on the answering texels, by their shadow maps."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lambent.baked.answering.stored import StoredAnswer
from lambent.core.arrays import Floats, sums_of
from lambent.core.geometry.directions import normalize
from lambent.realtime.answering.texture_detail import samples_of
from lambent.realtime.lamps.drawn import ShadowedLamp
from lambent.realtime.light.baked import BakedScene


class LampChanges:
    """Changes of direct light on the answering texels of a scene."""

    def __init__(self, baked: BakedScene, stored: StoredAnswer) -> None:
        self._baked, self._stored = baked, stored
        self._before: dict[int, Floats] = {}  # light of lamps as baked, by number

    def of(self, lamps: Iterable[tuple[ShadowedLamp, ShadowedLamp]]) -> NDArray[np.float32]:
        """(G, T, 3) W/m^2, by light group, from lamps as baked and as they are now."""
        found = np.zeros_like(self._stored.answer.direct)
        for before, now in lamps:
            number = before.record.number
            if number not in self._before:
                self._before[number] = before.irradiance(*self._places)
            found[before.record.group] += (now.irradiance(*self._places) - self._before[number]) * self._baked.unit
        return found

    @cached_property
    def _places(self) -> tuple[Floats, Floats]:
        """Positions and normals (T, 3) of the texels: means over what lies in them, else over their point's texels."""
        baked, stored = self._baked, self._stored
        assert baked.irradiance is not None, "an answer has a light map"
        height, width = baked.irradiance.shape[:2]
        samples = samples_of(baked, np.arange(len(baked.faces)), (width, height))
        corner = baked.faces[samples.face].astype(np.int64)
        both = (np.asarray(of, float)[corner] for of in (baked.positions, baked.normals))
        values = np.concatenate([np.einsum("nk,nkc->nc", samples.weights, of) for of in both], axis=1)
        sums = sums_of(np.column_stack([values, np.ones(len(values))]), samples.texel, height * width)
        here, closest = sums[stored.texels // 2], stored.answer.near.closest
        here = np.where(here[:, 6:] > 0, here, sums_of(here, closest, len(stored.point_sun))[closest])
        sign = np.where(stored.texels % 2 == 0, 1.0, -1.0)
        return here[:, :3] / np.maximum(here[:, 6:], 1), normalize(here[:, 3:6].astype(float)) * sign[:, None]
