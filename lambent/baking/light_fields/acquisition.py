"""What the points of a light field see: octahedral maps of radiance and of inverse distance, many points at once.

With the light map as radiance cache a diffuse surface shows its baked light, and a path goes on from glossy ones alone:
most end where they begin, at the first surface. The object itself is in the scene like everything else.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.light.cache import LightMapCache
from lambent.baking.running.tiles import slices
from lambent.baking.tracing import path_tracer, rays
from lambent.baking.tracing.lights.sun import Sun
from lambent.baking.tracing.rays import array_of, block_sums, independent, vectors
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry.octahedral import bordered, texel_directions
from lambent.core.light.colour import HALF_MAX

PATHS_AT_ONCE = 1 << 21
CONTRAST = 0.2  # of the brighter of two texels beside each other: from there on both are traced in parts
BENEATH = 0.25  # sine of the angle under a point's horizon from where on only surfaces beside it look


@dataclass(frozen=True)
class Surroundings:
    """The Mitsuba scene that points see; with a `cache` it is without diffuse terms. Paths meet `depth` surfaces.

    The disc of a `sun` is left out where nothing hides it: pixels add it by themselves, as far as they see it.
    """

    scene: Any
    cache: LightMapCache | None
    depth: int
    sun: Sun | None = None

    def without_sun(self, light: Any, ray: Any, si: Any) -> Any:
        """Light (mi.Color3f) along rays that meet `si` first, without the sun's disc behind nothing."""
        if self.sun is None:
            return light
        return light - dr.select(si.is_valid(), 0.0, self.sun.radiance(ray.d))


@dataclass(frozen=True)
class _First:
    """What rays meet first: its light (mi.Color3f) without what it mirrors, whether it mirrors, whether it is there."""

    light: Any
    mirrors: Any
    met: Any


def radiance_maps(
    around: Surroundings, points: Floats, texels: int, strata: int, seed: int, onward: int = 1,
    normals: Floats | None = None, covers: bool = False,
) -> tuple[NDArray[np.float32], Flags]:  # fmt: skip
    """Maps (P, texels, texels, 3) of the radiance that arrives at points (P, 3), and which texels show a surface.

    Where the ray through a texel's middle meets no glossy surface, and its neighbours show nearly the same, its light
    is the texel's (Whitted 1980), unless, with `covers`, a lamp is seen through the middle of one of its quarters or
    beside it: lamps smaller than texels would be lost. In other texels, rays go through strata x strata parts, and
    `onward` paths go on from each glossy surface that these meet first. Beneath points whose surface has `normals`
    (P, 3), where next to no reflection looks, glossy surfaces are met through the middle alone. A path that is not
    finite counts as black. A texel holds the light of surfaces or of the sky, as its middle does: as
    `inverse_distances` has it, and look-ups tell them apart. With `covers`, it has that of surfaces where any of its
    quarters meets one: as `covered_distances`. Without, all texels count as showing one.
    """
    found = np.empty((len(points), texels, texels, 3), np.float32)
    shows = np.full(found.shape[:3], True)
    for mine in slices(len(points), max(1, PATHS_AT_ONCE // texels**2)):
        some, shape = points[mine], found[mine].shape
        every = dr.arange(mi.UInt32, len(some) * texels**2)
        first = _first(around, _rays(some, every, texels, mi.Point2f(0.5)))
        dr.eval(first.light, first.mirrors, first.met)
        light, solid, mirrors = array_of(first.light), np.array(first.met), np.array(first.mirrors)
        lamps: Flags = np.full(shape[:3], False)
        if covers:
            quarters, glow = _quarters(around.scene, some, texels)
            lamps = np.asarray(glow.any(axis=(3, 4)))
            shows[mine] = (quarters > 0).any(axis=(3, 4))
            mixed = ~solid & shows[mine].ravel()
            light[mixed] = _parted(around, some, texels, np.flatnonzero(mixed), mixed[mixed], 2, onward, ~seed)
        edges = unlike(np.zeros(shape), lamps)
        parted = unlike(light.reshape(shape), solid.reshape(shape[:3])) | edges | unlike(np.zeros(shape), edges)
        parted = parted.ravel() & (strata > 1)
        beneath = np.zeros(len(light), bool) if normals is None else _beneath(normals[mine], texels).ravel()
        single = mirrors & beneath
        if covers:
            parted, mirrors = parted & ~mixed, mirrors & ~mixed  # they are traced
        for which, parts in ((single, 1), ((mirrors | parted) & ~single, strata)):
            index = np.flatnonzero(which)
            light[index] = _parted(around, some, texels, index, solid[index], parts, onward, seed + mine.start)
        found[mine] = light.reshape(shape)
    return found, shows


class TracedMaps:
    """Maps (P, E, E, 3) of the radiance at points (P, 3), traced where they are read: through the middles of texels.

    They serve trials, which read few texels of many maps; each is traced once.
    """

    dtype: np.dtype[Any] = np.dtype(np.float32)

    def __init__(self, around: Surroundings, points: Floats, texels: int, seed: int) -> None:
        self._around, self._points, self._seed = around, points, seed
        self.shape = len(points), texels, texels, 3
        self._light = np.zeros((self.size // 3, 3), np.float32)  # of all texels, flat
        self._traced = np.zeros(len(self._light), bool)

    @property
    def size(self) -> int:
        """How many numbers the maps have."""
        return math.prod(self.shape)

    @property
    def nbytes(self) -> int:
        """How large the maps are."""
        return self.size * self.dtype.itemsize

    def __getitem__(self, key: tuple[Indices, Indices, Indices]) -> NDArray[np.float32]:
        """(..., 3) light of texels by point, row and column, (...) integers each."""
        read = np.ravel_multi_index(key, self.shape[:3])
        new = np.unique(read[~self._traced[read]])
        for mine in slices(len(new), PATHS_AT_ONCE):
            ray = _rays(self._points, mi.UInt32(new[mine].astype(np.uint32)), self.shape[1], mi.Point2f(0.5))
            self._light[new[mine]] = array_of(_radiance(self._around, ray, 1, self._seed + mine.start)[0])
        self._traced[new] = True
        return np.asarray(self._light[read])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """All maps."""
        return self[tuple(np.indices(self.shape[:3]))].astype(dtype or self.dtype)


def unlike(light: Floats, solid: Flags) -> Flags:
    """Texels (P, E, E) that differ from a neighbour by CONTRAST of their light (P, E, E, 3), or in what is `solid`."""
    light, there = bordered(light, 1), bordered(solid[..., None], 1)[..., 0]
    found = np.zeros(there.shape, bool)
    for one, other in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[:, :, 1:], np.s_[:, :, :-1])):
        a, b = light[one], light[other]
        differ = (np.abs(a - b) > CONTRAST * np.maximum(a, b)).any(axis=-1) | (there[one] != there[other])
        found[one] |= differ
        found[other] |= differ
    return found[:, 1:-1, 1:-1]


def _beneath(normals: Floats, texels: int) -> Flags:
    """(P, texels, texels) which directions go BENEATH planes of normals (P, 3)."""
    return np.asarray(np.moveaxis(texel_directions(texels) @ normals.T, -1, 0) < -BENEATH)


def _parted(
    around: Surroundings, points: Floats, texels: int, index: Indices, solid: Flags, strata: int, onward: int, seed: int
) -> NDArray[np.float32]:
    """Light (k, 3) of texels `index` (k,), numbered through the maps of points, in strata x strata parts.

    Parts that differ from the middle in whether they meet a surface, `solid` (k,), are left out.
    """
    found = np.zeros((len(index), 3), np.float32)
    samples = strata * strata
    for mine in slices(len(index), max(1, PATHS_AT_ONCE // (samples * onward))):
        width = (mine.stop - mine.start) * samples
        own = (seed + mine.start + strata) & 0xFFFFFFFF
        thread = dr.arange(mi.UInt32, width)
        part, texel = thread % samples, thread // samples
        u = mi.Point2f(0.5) if strata == 1 else independent(own, width).next_2d()
        within = mi.Point2f((part % strata + u.x) / strata, (part // strata + u.y) / strata)
        ray = _rays(points, dr.gather(mi.UInt32, mi.UInt32(index[mine].astype(np.uint32)), texel), texels, within)
        light, met = _radiance(around, ray, onward, own ^ 0xFFFFFFFF)
        alike = met == dr.gather(mi.Bool, mi.Bool(solid[mine]), texel)
        count = dr.gather(mi.UInt32, dr.block_sum(dr.select(alike, mi.UInt32(1), 0), samples), texel)
        share = dr.select(count > 0, dr.select(alike, dr.rcp(mi.Float(count)), 0.0), 1 / samples)
        found[mine] = block_sums(light * share, samples)
    return found


def _first(around: Surroundings, ray: Any) -> _First:
    si = rays.intersect(around.scene, ray, mi.Bool(True), rays.has_holes(around.scene))
    light = around.without_sun(si.emitter(around.scene).eval(si), ray, si)
    mirrors = si.is_valid()
    if around.cache is not None:
        light += dr.select(mirrors, around.cache(si, mirrors), 0.0)
        mirrors &= mi.has_flag(si.bsdf(ray).flags(), mi.BSDFFlags.Smooth)
    return _First(light, mirrors, si.is_valid())


def _radiance(around: Surroundings, ray: Any, onward: int, seed: int) -> tuple[Any, Any]:
    """Radiance (mi.Color3f) along rays, from glossy surfaces by the mean of `onward` paths; which met a surface."""
    first = _first(around, ray)
    light, met = first.light, first.met
    dr.eval(light, first.mirrors, met)
    index = dr.compress(first.mirrors)
    if not dr.width(index):
        return light, met
    again = dr.gather(mi.UInt32, index, dr.arange(mi.UInt32, dr.width(index) * onward) // onward)
    start = path_tracer.camera_start(dr.gather(mi.Ray3f, ray, again))
    sampler = independent(seed & 0xFFFFFFFF, dr.width(again))
    value = path_tracer.radiance(around.scene, sampler, start, around.depth, around.cache)
    value = dr.select(dr.all(dr.isfinite(value)), value, 0.0)
    mean = mi.Color3f(*(dr.block_sum(component, onward) / onward for component in value))
    dr.scatter(light, mean, index)
    return light, met


def inverse_distances(scene: Any, points: Floats, texels: int) -> NDArray[np.float16]:
    """Maps (P, texels, texels), 1/m, of what points (P, 3) see through the texels' centres; 0 for nothing."""
    return _met(scene, points, texels)[0]


def _met(scene: Any, points: Floats, texels: int) -> tuple[NDArray[np.float16], Flags]:
    """As `inverse_distances`, and which rays meet a surface that emits light, (P, texels, texels) each."""
    found, glow = np.zeros(len(points) * texels * texels, np.float16), np.zeros(len(points) * texels * texels, bool)
    holes = rays.has_holes(scene)
    for mine in slices(len(found), PATHS_AT_ONCE):
        place = dr.opaque(mi.UInt32, mine.start) + dr.arange(mi.UInt32, mine.stop - mine.start)
        ray = _rays(points, place, texels, mi.Point2f(0.5))
        si = rays.intersect(scene, ray, mi.Bool(True), holes)
        inverse = dr.select(si.is_valid(), dr.rcp(dr.maximum(dr.norm(si.p - ray.o), 1 / HALF_MAX)), 0.0)
        lit = si.is_valid() & dr.any(si.emitter(scene).eval(si) > 0)
        dr.eval(inverse, lit)
        found[mine], glow[mine] = np.array(inverse).astype(np.float16), np.array(lit)
    shape = len(points), texels, texels
    return found.reshape(shape), glow.reshape(shape)


def covered_distances(scene: Any, points: Floats, texels: int) -> tuple[NDArray[np.float16], NDArray[np.uint8]]:
    """As `inverse_distances`, of quarters where a texel's middle shows the sky; and `cover` of a light field."""
    quarters = _quarters(scene, points, texels)[0].astype(float)
    solid = quarters > 0
    mean = quarters.sum(axis=(3, 4)) / np.maximum(solid.sum(axis=(3, 4)), 1)
    middle = inverse_distances(scene, points, texels)
    bits = solid.reshape(*solid.shape[:3], 4) << np.arange(4)
    return np.where(middle > 0, middle, mean).astype(np.float16), bits.sum(axis=3).astype(np.uint8)


def _quarters(scene: Any, points: Floats, texels: int) -> tuple[NDArray[np.float16], Flags]:
    """(P, texels, texels, 2, 2) inverse distances through the middles of texels' quarters, and where a lamp is met."""
    inverse, glow = _met(scene, points, 2 * texels)
    shape, order = (len(points), texels, 2, texels, 2), (0, 1, 3, 2, 4)
    return inverse.reshape(shape).transpose(order), glow.reshape(shape).transpose(order)


def _rays(points: Floats, place: Any, texels: int, within: Any) -> Any:
    """Rays through texels, numbered through the maps one after another, at `within` (mi.Point2f) of each."""
    origin = dr.gather(mi.Point3f, vectors(mi.Point3f, points), place // (texels * texels))
    column, row = place % texels, place // texels % texels
    uv = mi.Point2f((column + within.x) / texels, (row + within.y) / texels)
    return mi.Ray3f(origin, direction(uv))


def direction(uv: Any) -> Any:
    """Unit directions (mi.Vector3f) of mi.Point2f: `core.geometry.octahedral.from_square`; a test compares them."""
    x, y = 2 * uv.x - 1, 2 * uv.y - 1
    z = 1 - dr.abs(x) - dr.abs(y)
    over = dr.maximum(-z, 0)
    return dr.normalize(mi.Vector3f(x - dr.mulsign(over, x), y - dr.mulsign(over, y), z))
