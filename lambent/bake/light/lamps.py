"""Direct light of lamps on the light map, by shadow rays from each of a texel's points, so that it needs no filter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

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
from lambent.core.geometry.sequences import hammersley
from lambent.core.light.colour import HALF_MAX, luminance
from lambent.store.lamps import MOST_LAMPS

OF_OPENING = 4  # rays to an opening from each of a texel's points
NEAR_FIELD = 16  # likewise, samples without shadows
MOST_NEAR = 4.0  # times the light as drawn: next to the rim of an opening few samples have most of the light
AROUND = 1  # texels to each side that count as reached: edges of shadows cross the borders of texels


@dataclass(frozen=True, eq=False)
class LampLight:
    """Direct light of lamps on one side of the light map.

    Attributes
    ----------
    light : (G, H, W, 3) float16
        Irradiance of all lamps, by light group, W/m^2.
    drawn : (G, H, W, 3) float16
        Irradiance of those that are drawn, as they are drawn.
    reached : (H, W) uint64
        Bit k: whether the light of drawn lamp k arrives at the texel or at a neighbour of its chart; 1 in gutters.
    shaded : (H, W) uint64
        Bit k: whether a part of drawn lamp k's opening is hidden from a part of the texel.
    """

    light: NDArray[np.float16]
    drawn: NDArray[np.float16]
    reached: NDArray[np.uint64]
    shaded: NDArray[np.uint64]


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
        found = (luminance(self._of(lamp, 1)[:, :, 0]).std(axis=1) for lamp in range(self._lamps.count))
        return np.array([one @ area for one in found])

    def light(self, groups: Sequence[int], count: int, drawn: Sequence[int]) -> LampLight:
        """The light of all lamps in `count` groups, those of each in `groups`; `drawn` are numbers of lamps."""
        light = np.zeros((2, count, *self._labels.shape, 3), np.float32)  # of all lamps, of those drawn
        reached, shaded = np.zeros((2, *self._labels.shape), np.uint64)
        for lamp in range(self._lamps.count if len(self._mine) else 0):
            each, sized = self._of(lamp), self._lamps.is_sized(lamp)
            of_map = self._on_map(each)
            light[0, groups[lamp]] += of_map * self._near_field(lamp) if sized else of_map
            if lamp in drawn:
                light[1, groups[lamp]] += of_map
                bit = np.uint64(drawn.index(lamp))
                reached |= self._near(of_map) << bit
                shaded |= self._near(self._on_map(_dark(each))) << bit if sized else np.uint64(0)
        filled = [[fill(one, self.known, self._labels) for one in each] for each in light]
        whole, of_drawn = np.minimum(filled, HALF_MAX).astype(np.float16)
        return LampLight(whole, of_drawn, reached, shaded)

    def _on_map(self, each: Floats) -> Floats:
        """(H, W, 3) means of samples (K, POINTS, n, 3) of texels."""
        of_map = np.zeros((*self._labels.shape, 3), np.float32)
        of_map.reshape(-1, 3)[self._texels.index[self._mine]] = each.mean(axis=(1, 2))
        return of_map

    def _near(self, light: Floats) -> NDArray[np.uint64]:
        """1 where light (H, W, 3) is not black within AROUND texels, 0 elsewhere."""
        lit = np.asarray(light.any(axis=-1, keepdims=True), np.float32)
        near, _ = chart_means(lit, self.known, self._labels, AROUND)
        found: Flags = (near[..., 0] > 0) | ~self.known
        return found.astype(np.uint64)

    def _of(self, lamp: int, count: int = OF_OPENING) -> Floats:
        """(K, POINTS, n, 3) irradiance of a lamp at the points: by `count` points of its opening, or its one point."""
        number, (first, x, y) = dr.opaque(mi.UInt32, lamp), self._points(count)
        found = []
        for k in range(count if self._lamps.is_sized(lamp) else 1):
            at = first + dr.opaque(mi.UInt32, POINTS * k)
            u = mi.Point2f(dr.gather(mi.Float, x, at), dr.gather(mi.Float, y, at))
            light = array_of(self._lamps.of(number, self._at, u, mi.Bool(True)))
            found.append(light.reshape(len(self._mine), POINTS, 3).clip(0, None))
        return np.stack(found, axis=2)

    def _near_field(self, lamp: int) -> Floats:
        """(H, W, 1) light of all the opening of a lamp over its light as drawn, without shadows; 1 where it is dark."""
        both = _unshadowed(self._lamps, dr.opaque(mi.UInt32, lamp), self._at, *self._points(NEAR_FIELD), NEAR_FIELD)
        drawn, whole = (np.array(dr.block_sum(mi.luminance(light), POINTS)) for light in both)
        ratio = np.divide(whole, drawn, out=np.ones_like(drawn), where=drawn > 0)
        of_map = np.ones((*self._labels.shape, 1), np.float32)
        of_map.reshape(-1)[self._texels.index[self._mine]] = ratio.clip(0, MOST_NEAR)
        return of_map

    def _points(self, count: int) -> tuple[Any, Any, Any]:
        """The first of `count` samples of openings for each of the points, and coordinates (mi.Float) of all.

        They are stratified within a texel, and the same for all texels. What they miss of a shadow, all light and the
        drawn light miss alike.
        """
        x, y = (mi.Float(part) for part in hammersley(POINTS * count).T.astype(np.float32))
        return dr.arange(mi.UInt32, len(self._mine) * POINTS) % POINTS, x, y


@dr.syntax
def _unshadowed(lamps, lamp, at, point, x, y, count):  # type: ignore[no-untyped-def]
    """Sums (mi.Color3f) of `count` samples of `LampRays.unshadowed`."""
    width = dr.width(at.p)
    drawn, whole = dr.zeros(mi.Color3f, width), dr.zeros(mi.Color3f, width)
    end = point + dr.opaque(mi.UInt32, POINTS * count)
    point = mi.UInt32(point)
    while point < end:
        u = mi.Point2f(dr.gather(mi.Float, x, point), dr.gather(mi.Float, y, point))
        one, other = lamps.unshadowed(lamp, at, u, mi.Bool(True))
        drawn += one
        whole += other
        point += POINTS
    return drawn, whole


def _dark(light: Floats) -> Floats:
    """1 where light (..., 3) is 0 in all channels, else 0, likewise (..., 3)."""
    return np.broadcast_to(np.float32((light == 0).all(axis=-1, keepdims=True)), light.shape)


def drawn_of(detail: Floats) -> tuple[int, ...]:
    """The lamps, by number, that are worth drawing by pixel: those with the most detail, the first one first."""
    ranked = np.argsort(-detail, kind="stable")[:MOST_LAMPS]
    return tuple(int(number) for number in ranked if detail[number] > 0)
