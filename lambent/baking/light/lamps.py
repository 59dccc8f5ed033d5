"""Direct light of lamps on the light map, by shadow rays from each of a texel's points, so that it needs no filter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.light.denoise import fill
from lambent.baking.light.noise import chart_means
from lambent.baking.light.sampling import points_of
from lambent.baking.surfaces.texels import POINTS, Sides
from lambent.baking.tracing.lights.lamps import LampRays
from lambent.baking.tracing.rays import array_of
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry.sequences import r2
from lambent.core.light.colour import HALF_MAX, luminance
from lambent.store.lamps import MOST_LAMPS

OF_OPENING = 4  # rays to an opening from each of a texel's points
NEAR_FIELD = 32  # likewise, samples without shadows: under a sphere half of them face away
SHARP = 0.3  # deviation of visible shares around a texel: a penumbra of 2.7 texels
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
    sharp : (H, W) uint64
        Bit k: whether the visible share of drawn lamp k's opening changes too much from texel to texel for `seen`.
    seen : (n, H, W) uint8
        Visible share of the opening of each drawn lamp that has one, in the order of these; 255 is all.
    """

    light: NDArray[np.float16]
    drawn: NDArray[np.float16]
    reached: NDArray[np.uint64]
    sharp: NDArray[np.uint64]
    seen: NDArray[np.uint8]


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
        found = (luminance(self._of(lamp)).std(axis=1) for lamp in range(self._lamps.count))
        return np.array([one @ area for one in found])

    def light(self, groups: Sequence[int], count: int, drawn: Sequence[int]) -> LampLight:
        """The light of all lamps in `count` groups, those of each in `groups`; `drawn` are numbers of lamps."""
        light = np.zeros((2, count, *self._labels.shape, 3), np.float32)  # of all lamps, of those drawn
        reached, sharp = np.zeros((2, *self._labels.shape), np.uint64)
        sized = [place for place in drawn if self._lamps.is_sized(place)]
        seen = np.zeros((len(sized), *self._labels.shape), np.uint8)
        of_map: Floats
        whole: Floats
        for lamp in range(self._lamps.count if len(self._mine) else 0):
            if self._lamps.is_sized(lamp):
                share, is_sharp = self._shares(lamp)
                of_map, whole = (share * one for one in self._unshadowed(lamp))
            else:
                of_map = whole = self._on_map(self._of(lamp).mean(axis=1))
            light[0, groups[lamp]] += whole
            if lamp in drawn:
                light[1, groups[lamp]] += of_map
                bit = np.uint64(drawn.index(lamp))
                reached |= self._near(of_map) << bit
                if lamp in sized:
                    sharp |= self._near(is_sharp) << bit
                    seen[sized.index(lamp)] = np.rint(255 * fill(share, self.known, self._labels)[..., 0])
        filled = [[fill(one, self.known, self._labels) for one in each] for each in light]
        total, of_drawn = np.minimum(filled, HALF_MAX).astype(np.float16)
        return LampLight(total, of_drawn, reached, sharp, seen)

    def _shares(self, lamp: int) -> tuple[Floats, Floats]:
        """Visible share (H, W, 1) of an opening, and 1 where it is not smooth; elsewhere it is averaged."""
        seen = self._sums(self._lamps.seen, mi.Float, lamp, OF_OPENING)
        part, whole = (np.array(one).reshape(-1, POINTS).sum(axis=1) for one in seen)
        share = self._on_map((part / whole)[:, None])
        both = np.concatenate([share, share**2], axis=-1)
        mean, square = np.split(chart_means(both, self.known, self._labels, AROUND)[0], 2, axis=-1)
        is_sharp = np.asarray(square - mean**2 > SHARP**2, np.float32)
        return np.where(self._near(is_sharp)[..., None] > 0, share, mean), is_sharp

    def _on_map(self, values: Floats) -> Floats:
        """(H, W, C) of values (K, C) of texels."""
        of_map = np.zeros((*self._labels.shape, values.shape[-1]), np.float32)
        of_map.reshape(-1, values.shape[-1])[self._texels.index[self._mine]] = values
        return of_map

    def _near(self, light: Floats) -> NDArray[np.uint64]:
        """1 where light (H, W, 3) is not black within AROUND texels, 0 elsewhere."""
        lit = np.asarray(light.any(axis=-1, keepdims=True), np.float32)
        near, _ = chart_means(lit, self.known, self._labels, AROUND)
        found: Flags = (near[..., 0] > 0) | ~self.known
        return found.astype(np.uint64)

    def _of(self, lamp: int) -> Floats:
        """(K, POINTS, 3) irradiance of a lamp at the points, each by a ray to a point of its opening, if it has one."""
        first, x, y = self._points(1)
        u = mi.Point2f(dr.gather(mi.Float, x, first), dr.gather(mi.Float, y, first))
        light = self._lamps.of(dr.opaque(mi.UInt32, lamp), self._at, u, mi.Bool(True))
        return array_of(light).reshape(len(self._mine), POINTS, 3).clip(0, None)

    def _unshadowed(self, lamp: int) -> tuple[Floats, Floats]:
        """Light (H, W, 3) of a lamp without shadows: as drawn, and of all the opening."""
        both = self._sums(self._lamps.unshadowed, mi.Color3f, lamp, NEAR_FIELD)
        drawn, whole = (array_of(light).reshape(-1, POINTS, 3).mean(axis=1) / NEAR_FIELD for light in both)
        return self._on_map(drawn), self._on_map(whole)

    def _sums(self, estimate: Callable[..., Any], kind: Any, lamp: int, count: int) -> tuple[Any, Any]:
        """Sums of both results of an estimate by `count` samples of an opening from each point."""
        zero = dr.zeros(kind, dr.width(self._at.p))
        found = _sums(estimate, zero, dr.opaque(mi.UInt32, lamp), self._at, *self._points(count), count)
        return found[0], found[1]

    def _points(self, count: int) -> tuple[Any, Any, Any]:
        """The first of `count` samples of openings for each of the points, and coordinates (mi.Float) of all.

        They are evenly distributed for each texel, and the same for all: R2, because a lattice meets the order of the
        faces of round openings.
        """
        x, y = (mi.Float(part) for part in r2(POINTS * count).T.astype(np.float32))
        return dr.arange(mi.UInt32, len(self._mine) * POINTS) % POINTS, x, y


@dr.syntax
def _sums(estimate, zero, lamp, at, point, x, y, count):  # type: ignore[no-untyped-def]
    """Sums of `count` samples of both results of an estimate of `LampRays`, from `zero`."""
    one, other = zero + 0.0, zero + 0.0
    end = point + dr.opaque(mi.UInt32, POINTS * count)
    point = mi.UInt32(point)
    while point < end:
        u = mi.Point2f(dr.gather(mi.Float, x, point), dr.gather(mi.Float, y, point))
        found, as_well = estimate(lamp, at, u, mi.Bool(True))
        one += found
        other += as_well
        point += POINTS
    return one, other


def drawn_of(detail: Floats) -> tuple[int, ...]:
    """The lamps, by number, that are worth drawing by pixel: those with the most detail, the first one first."""
    ranked = np.argsort(-detail, kind="stable")[:MOST_LAMPS]
    return tuple(int(number) for number in ranked if detail[number] > 0)
