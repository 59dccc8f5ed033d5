"""Light that falls on the selected object: its illuminance by light group, from the light map of the present room."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import cast

import numpy as np

from lambent.baked.answering.answer import Neighbours, side_by_side, upsampled
from lambent.baked.answering.delta_bytes import from_delta_bytes
from lambent.baked.answering.stored import answer_name, has_answer
from lambent.baking.surfaces.coverage import Pieces, pieces_of
from lambent.core.arrays import Floats, Indices
from lambent.core.light.light_mix import LightMix
from lambent.core.light.photometry import ILLUMINANCE, photometric
from lambent.realtime.light.baked import BakedScene
from lambent.realtime.light.group_arrays import GroupArrays
from lambent.scenes.light_groups import SUN
from lambent.store.contract import sun_left_out
from lambent.store.store import Store
from lambent.viewer.background.work import Work, pending

ALL = "all light"
WITHOUT_SUN = "without the direct sun: the sky is turned, or the store lacks `lambent bake --only answer`"


@dataclass(frozen=True)
class Fallen:
    """Irradiance (n, K, 3), W/m^2, by group `names` on K texels of an object, and the area (K,), m^2, in each."""

    names: tuple[str, ...]
    light: Floats
    area_m2: Floats
    note: str = ""

    def illuminance_lx(self, mix: LightMix) -> dict[str, float]:
        """Mean illuminance of each group in a mix, lx."""
        mean = np.average(self.light, axis=1, weights=self.area_m2)
        return {
            name: float(photometric(one * np.array(mix.of(name).factor), ILLUMINANCE))
            for name, one in zip(self.names, mean, strict=True)
        }

    def range_lx(self, mix: LightMix) -> tuple[float, float]:
        """Illuminance that 5 % and 95 % of the surface fall below in a mix, lx."""
        factors = np.array([mix.of(name).factor for name in self.names])
        texels = photometric(np.einsum("nkc,nc->kc", self.light, factors), ILLUMINANCE)
        order = np.argsort(texels)
        below = np.cumsum(self.area_m2[order]) / self.area_m2.sum()
        low, high = np.interp([0.05, 0.95], below, texels[order])
        return float(low), float(high)


@dataclass
class FallingLight:
    """Looks up light on objects in the background; `groups` gives the light by group that the window shows."""

    scene: BakedScene
    store: Store
    groups: Callable[[], GroupArrays | None]
    found: Fallen | None = None
    _of: tuple[frozenset[str], int] | None = None  # what `found` is, or will be, of
    _work: Work | None = field(default=None, repr=False)

    @property
    def busy(self) -> bool:
        return self._work is not None

    def follow(self, parts: frozenset[str], *, waits: bool) -> Fallen | None:
        """The light on an object of these parts; None until it is found. A new look-up `waits` for a drag to end."""
        self._work = pending(self._work)
        groups = self.groups()
        wanted = (parts, id(groups))
        if wanted != self._of and self._work is None and not waits:
            if self._of is None or parts != self._of[0]:
                self.found = None
            self._of = wanted

            def keep(found: Fallen | None) -> None:
                self.found = found

            self._work = Work(lambda _: self._light_on(parts, groups), keep)
        return self.found

    def _light_on(self, parts: frozenset[str], groups: GroupArrays | None) -> Fallen | None:
        sides, names = self._sides(groups), (ALL,) if groups is None else tuple(one.name for one in groups.records)
        cells, area_m2 = self._texels_of(parts)
        if not len(cells) or not sides:
            return None
        sun, lit = self.scene.sun, []
        number = (groups.number(SUN) if groups is not None else 0) or 0
        for side, light in sides.items():
            found = light.reshape(len(light), -1, 3)[:, cells].astype(np.float64) * self.scene.unit
            if sun is not None and self._sun is not None:
                found[number] += self._sun[2 * cells + side]
            lit.append(found)
        light = next((one for one in lit if _varies(one)), lit[0])  # a side that nobody sees is dark, or filled evenly
        note = WITHOUT_SUN if sun is not None and self._sun is None else ""
        return Fallen(names, light, area_m2, note)

    def _sides(self, groups: GroupArrays | None) -> dict[int, Floats]:
        """Light maps (n, H, W, 3) by group, by number of their side."""
        if groups is not None:
            return {side: light for side, light in enumerate(groups.sides) if light is not None}
        both = self.scene.irradiance, self.scene.irradiance_back
        return {side: light[None] for side, light in enumerate(both) if light is not None}

    def _texels_of(self, parts: frozenset[str]) -> tuple[Indices, Floats]:
        """Texels (K,) of objects, and the area in each, m^2."""
        chosen = np.zeros(len(self.scene.faces), bool)
        for record in self.scene.record.objects:
            if record.name in parts:
                chosen[record.first_face : record.first_face + record.face_count] = True
        if self._pieces is None:
            return np.zeros(0, int), np.zeros(0)
        mine = chosen[self._pieces.face]
        cells, number = np.unique(self._pieces.cell[mine], return_inverse=True)
        return cells, np.bincount(number, self._pieces.area[mine], minlength=len(cells)).astype(float)

    @cached_property
    def _pieces(self) -> Pieces | None:
        if self.scene.irradiance is None:
            return None
        height, width = self.scene.irradiance.shape[:2]
        geometry: dict[str, Floats] = {
            "positions": self.scene.positions,
            "faces": cast(Floats, self.scene.faces),
            "uv2": self.scene.uv2,
        }
        return pieces_of(geometry, width, height)

    @cached_property
    def _sun(self) -> Floats | None:
        """(2 H W, 3) direct irradiance of the sun, W/m^2, on both sides of the texels; None where it is not known."""
        baked, sun = sun_left_out(self.store), self.scene.sun
        as_baked = baked is not None and sun is not None and baked.direction == sun.direction
        if not as_baked or not has_answer(self.store) or self.scene.replaced or self.scene.irradiance is None:
            return None
        read = [self.store.read(answer_name(part)) for part in ("point_sun", "texels", "near", "shares")]
        texels, near = map(from_delta_bytes, read[1:3])
        found = np.zeros((2 * self.scene.irradiance[..., 0].size, 3))
        found[texels] = upsampled(side_by_side(read[0][None]), Neighbours(near, read[3]))[0]
        return found


def _varies(light: Floats) -> bool:
    """Whether light (n, K, 3) differs over the surface."""
    low, high = np.percentile(light.sum(axis=(0, 2)), [5, 95])
    return bool(high > low)
