"""Direct light of lamps at points on the light map: exact at each of a texel's points, so that it needs no filter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake.light.denoise import fill
from lambent.bake.light.noise import chart_means
from lambent.bake.light.sampling import points_of
from lambent.bake.surfaces.texels import POINTS, Sides
from lambent.bake.tracing.lights.lamps import LampRays
from lambent.bake.tracing.rays import array_of
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.light.colour import HALF_MAX, luminance
from lambent.store.lamps import MOST_LAMPS

AROUND = 1  # texels to each side that count as reached: edges of shadows cross the borders of texels


@dataclass(frozen=True, eq=False)
class LampLight:
    """Direct light of lamps on one side of the light map.

    Attributes
    ----------
    light, drawn : (G, H, W, 3) float16
        Irradiance of all lamps and of those that are drawn, by light group, W/m^2.
    reached : (H, W) uint64
        Bit k: whether the light of drawn lamp k arrives at the texel or at a neighbour of its chart; 1 in gutters.
    """

    light: NDArray[np.float16]
    drawn: NDArray[np.float16]
    reached: NDArray[np.uint64]


class LampPoints:
    """The points of one side of a light map, under `lamps`; `labels` (H, W) are the charts of the map."""

    def __init__(self, lamps: LampRays, sides: Sides, labels: Indices) -> None:
        self._lamps, self._texels, self._labels = lamps, sides.texels, labels
        self._mine = np.flatnonzero(sides.valid.any(axis=1))
        self.known = np.zeros(labels.shape, bool)
        self.known.reshape(-1)[sides.texels.index[self._mine]] = True
        if len(self._mine):
            points = points_of(sides, self._mine)
            self._at = dr.zeros(mi.SurfaceInteraction3f, dr.width(points.position))
            self._at.p, self._at.n = points.position, mi.Normal3f(points.flat)
            self._at.sh_frame = mi.Frame3f(mi.Normal3f(points.normal))

    def detail(self) -> Floats:
        """(n,) what texels cannot show of each lamp: its deviation within them, lm/m^2, times their area, summed."""
        area = self._texels.area_m2[self._mine]
        return np.array([luminance(self._of(lamp)).std(axis=1) @ area for lamp in range(self._lamps.count)])

    def light(self, groups: Sequence[int], count: int, drawn: Sequence[int]) -> LampLight:
        """The light of all lamps in `count` groups, those of each in `groups`; `drawn` are numbers of lamps."""
        light = np.zeros((2, count, *self._labels.shape, 3), np.float32)  # of all lamps, of those drawn
        reached = np.zeros(self._labels.shape, np.uint64)
        for lamp in range(self._lamps.count if len(self._mine) else 0):
            each, of_map = self._of(lamp), np.zeros((*self._labels.shape, 3), np.float32)
            of_map.reshape(-1, 3)[self._texels.index[self._mine]] = each.mean(axis=1)
            light[0, groups[lamp]] += of_map
            if lamp in drawn:
                light[1, groups[lamp]] += of_map
                reached |= self._near(of_map) << np.uint64(drawn.index(lamp))
        filled = [[fill(one, self.known, self._labels) for one in each] for each in light]
        whole, of_drawn = np.minimum(filled, HALF_MAX).astype(np.float16)
        return LampLight(whole, of_drawn, reached)

    def _near(self, light: Floats) -> NDArray[np.uint64]:
        """1 where light (H, W, 3) is not black within AROUND texels, 0 elsewhere."""
        lit = np.asarray(light.any(axis=-1, keepdims=True), np.float32)
        near, _ = chart_means(lit, self.known, self._labels, AROUND)
        found: Flags = (near[..., 0] > 0) | ~self.known
        return found.astype(np.uint64)

    def _of(self, lamp: int) -> Floats:
        """(K, POINTS, 3) irradiance of a lamp at the points."""
        found = self._lamps.of(dr.opaque(mi.UInt32, lamp), self._at, mi.Bool(True))
        return array_of(found).reshape(len(self._mine), POINTS, 3).clip(0, None)


def drawn_of(detail: Floats) -> tuple[int, ...]:
    """The lamps, by number, that are worth drawing by pixel: those with the most detail, the first one first."""
    ranked = np.argsort(-detail, kind="stable")[:MOST_LAMPS]
    return tuple(int(number) for number in ranked if detail[number] > 0)
