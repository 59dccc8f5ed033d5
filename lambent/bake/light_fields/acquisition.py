"""What the points of a light field see: octahedral maps of radiance and of inverse distance, many points at once.

With the light map as radiance cache a diffuse surface shows its baked light, and a path goes on from glossy ones alone:
most end where they begin, at the first surface. The object itself is in the scene like everything else.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake.light.cache import LightMapCache
from lambent.bake.tiles import slices
from lambent.bake.tracing import path_tracer, rays
from lambent.bake.tracing.rays import block_sums, independent, vectors
from lambent.bake.tracing.sun import Sun
from lambent.core.arrays import Floats
from lambent.core.colour import HALF_MAX

PATHS_AT_ONCE = 1 << 21


@dataclass(frozen=True)
class Around:
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


def radiance_maps(
    around: Around, points: Floats, texels: int, strata: int, seed: int, onward: int = 1
) -> NDArray[np.float32]:
    """Maps (P, texels, texels, 3) of the radiance that arrives at points (P, 3).

    Rays go through strata x strata parts of each texel, and `onward` paths go on from the surface that each of them
    meets first, where that is glossy. A path that is not finite counts as black. A texel holds the light of surfaces or
    of the sky, as the ray through its middle meets one: as `inverse_distances` has it, and look-ups tell them apart.
    """
    found = np.zeros((len(points) * texels * texels, 3), np.float32)
    samples = strata * strata
    for mine in slices(len(found), max(1, PATHS_AT_ONCE // (samples * onward))):
        width = (mine.stop - mine.start) * samples
        sampler = independent((seed + mine.start) & 0xFFFFFFFF, width)
        thread, u = dr.arange(mi.UInt32, width), sampler.next_2d()
        part = thread % samples
        within = mi.Point2f((part % strata + u.x) / strata, (part // strata + u.y) / strata)
        place = dr.opaque(mi.UInt32, mine.start) + thread // samples
        light, met = _radiance(around, _rays(points, place, texels, within), onward, seed ^ (mine.start + 1))
        texel = dr.opaque(mi.UInt32, mine.start) + dr.arange(mi.UInt32, width // samples)
        middle = _rays(points, texel, texels, mi.Point2f(0.5))
        solid = rays.intersect(around.scene, middle, mi.Bool(True), rays.has_holes(around.scene)).is_valid()
        dr.eval(solid)
        alike = met == dr.gather(mi.Bool, solid, thread // samples)
        count = dr.gather(mi.UInt32, dr.block_sum(dr.select(alike, mi.UInt32(1), 0), samples), thread // samples)
        share = dr.select(count > 0, dr.select(alike, dr.rcp(mi.Float(count)), 0.0), 1 / samples)
        found[mine] = block_sums(light * share, samples)
    return found.reshape(len(points), texels, texels, 3)


def _radiance(around: Around, ray: Any, onward: int, seed: int) -> tuple[Any, Any]:
    """Radiance (mi.Color3f) along rays, from glossy surfaces by the mean of `onward` paths; which met a surface."""
    si = rays.intersect(around.scene, ray, mi.Bool(True), rays.has_holes(around.scene))
    light = around.without_sun(si.emitter(around.scene).eval(si), ray, si)
    met = si.is_valid()
    goes_on = mi.Bool(met)
    if around.cache is not None:
        light += dr.select(goes_on, around.cache(si, goes_on), 0.0)
        goes_on &= mi.has_flag(si.bsdf(ray).flags(), mi.BSDFFlags.Smooth)
    dr.eval(light, goes_on, met)
    index = dr.compress(goes_on)
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
    found = np.zeros(len(points) * texels * texels, np.float16)
    holes = rays.has_holes(scene)
    for mine in slices(len(found), PATHS_AT_ONCE):
        place = dr.opaque(mi.UInt32, mine.start) + dr.arange(mi.UInt32, mine.stop - mine.start)
        ray = _rays(points, place, texels, mi.Point2f(0.5))
        si = rays.intersect(scene, ray, mi.Bool(True), holes)
        inverse = dr.select(si.is_valid(), dr.rcp(dr.maximum(dr.norm(si.p - ray.o), 1 / HALF_MAX)), 0.0)
        found[mine] = np.array(inverse).astype(np.float16)
    return found.reshape(len(points), texels, texels)


def _rays(points: Floats, place: Any, texels: int, within: Any) -> Any:
    """Rays through texels, numbered through the maps one after another, at `within` (mi.Point2f) of each."""
    origin = dr.gather(mi.Point3f, vectors(mi.Point3f, points), place // (texels * texels))
    column, row = place % texels, place // texels % texels
    uv = mi.Point2f((column + within.x) / texels, (row + within.y) / texels)
    return mi.Ray3f(origin, direction(uv))


def direction(uv: Any) -> Any:
    """Unit directions (mi.Vector3f) of mi.Point2f: `core.octahedral.from_square`, with which a test compares it."""
    x, y = 2 * uv.x - 1, 2 * uv.y - 1
    z = 1 - dr.abs(x) - dr.abs(y)
    over = dr.maximum(-z, 0)
    return dr.normalize(mi.Vector3f(x - dr.mulsign(over, x), y - dr.mulsign(over, y), z))
