"""Photons: light followed from its sources through the scene, counted where it lands on the light map.

Photons leave emitters in proportion to power, scatter by the materials and are counted at each surface they hit, in W
per texel; divided by the texel's area, this is irradiance (Jensen 1996, with texels for discs). All samples are
independent: the lattices of low-discrepancy sequences show as stripes, which no denoiser recognises as noise.

A photon is absorbed with probability 1 - (r + t) for the direction it came from (thesis M, 3.1): it survives with a
probability equal to its scattered weight, whose mean over the scattered directions is r + t.

Light runs in the opposite direction to `path_tracer`: `si.wi` is the direction the photon came from. Materials are
reciprocal; measured tables are used with light and viewer swapped (`TracedScene`). Irradiance refers to the shading
normal, as in `path_tracer.irradiance`; smooth shading needs the factors of Veach 1997, 5.3.

Sums are integers and independent of the order in which threads add: results are bitwise identical.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.sky.guide import learn
from lambent.baking.sky.photons import SkyPhotons, find_importance
from lambent.baking.tracing import rays
from lambent.baking.tracing.lights.sun import Sun
from lambent.baking.tracing.rays import independent
from lambent.baking.tracing.scene_builder import light_map_texel
from lambent.core.arrays import Floats
from lambent.scenes.scene import Scene

PHOTONS_AT_ONCE = 1 << 19
UNIT = 1 << 20  # integers per photon of mean power
POWER_PHOTONS = 1 << 14  # of the pre-pass that estimates the mean power
IMPORTANCE_PHOTONS = 1 << 20  # of the pre-pass that estimates where the light map needs photons
SAME = 2e-4  # metres, and share of the largest coordinate: twice the offset of Mitsuba's `sample_ray` from a surface
STEEPEST = 20.0  # largest ratio of the cosines to shading and true normal; larger ones, at grazing, are noise


def shoot(
    scene: Any, shape: tuple[int, int, int], photons: int, max_bounces: int, seed: int, sky: SkyPhotons | None = None,
    unseen: Sun | None = None,
) -> Floats:  # fmt: skip
    """Flux (sides, H, W, 3) float64 in W on each texel, from `photons` photons.

    Parameters
    ----------
    scene : mi.Scene
        Its meshes have light map coordinates.
    shape : (sides, H, W)
        Of the light map, for the normal's side or both.
    max_bounces : int
        Photons are counted up to and including the surface they hit after this many bounces.
    seed : int
        The same seed gives the same flux.
    sky : SkyPhotons, optional
        Draws the environment's photons; otherwise they start on a disc as large as the scene.
    unseen : Sun, optional
        Its photons count only from their second surface on, not counting clear glass that they pass straight through.
    """
    sums = dr.zeros(mi.UInt64, int(np.prod(shape)) * 3)
    rng = np.random.default_rng(seed)
    scale = _units_per_watt(scene, sky)
    if scale == 0:
        return np.zeros((*shape, 3))
    for first in range(0, photons, PHOTONS_AT_ONCE):
        sampler = independent(int(rng.integers(1 << 32)), min(PHOTONS_AT_ONCE, photons - first))
        ray, power, first = _emitted(scene, sampler, sky, unseen)
        count = partial(_count, sums, shape)
        power *= dr.opaque(mi.Float, scale)
        _trace(scene, sampler, ray, power, count, max_bounces, rays.has_holes(scene), first, unseen)
        dr.eval(sums)
    return np.array(sums).astype(np.float64).reshape(*shape, 3) / (scale * photons)


def learnt_sky(scene: Scene, whole: Any, over_area: Floats, max_bounces: int) -> SkyPhotons | None:
    """Learn in a pre-pass how to draw the environment's photons; None without an environment or a guide. Deterministic.

    over_area (H, W) is 1 over the area of a light map's texel in m^2, 0 without surface.
    """
    environment = whole.environment()
    if environment is None:
        return None
    emitter = getattr(environment, "sky", environment)  # the one inside a guided sky
    guide = learn(scene, whole, emitter, keep_open=True)
    if guide is None:
        return None
    sky = SkyPhotons(scene, whole, emitter, guide)
    holes = rays.has_holes(whole)
    sampler = independent(1, IMPORTANCE_PHOTONS)
    find_importance(
        sky, lambda ray, power, count: _trace(whole, sampler, ray, power, count, max_bounces, holes), over_area, sampler
    )
    return sky


def _units_per_watt(scene: Any, sky: SkyPhotons | None) -> float:
    """Integers per W; 0 if nothing is emitted."""
    _, power, _ = _emitted(scene, independent(0, POWER_PHOTONS), sky, None)
    mean = float(np.array(power, np.float64).mean())
    return UNIT / mean if mean > 0 else 0.0


def _emitted(scene: Any, sampler: Any, by_landing: SkyPhotons | None, unseen: Sun | None) -> tuple[Any, Any, Any]:
    """Rays of photons, power (mi.Color3f) in W times number of photons, and the share that counts where they land."""
    u, place, direction = sampler.next_1d(), sampler.next_2d(), sampler.next_2d()
    number, weight, _ = scene.sample_emitter(u)
    emitter = dr.gather(mi.EmitterPtr, scene.emitters_dr(), number)
    sky = emitter.is_environment()
    ray, power = emitter.sample_ray(0.0, u, place, direction, ~sky)
    ray.o = _nearer(scene, emitter, ray, place)
    if scene.environment() is not None:
        if by_landing is None:
            from_sky, power_of_sky = _from_environment(scene, place, direction)
        else:
            from_sky, power_of_sky, _ = by_landing.emit(sampler.next_1d(), place, direction)
        ray = mi.Ray3f(dr.select(sky, from_sky.o, ray.o), dr.select(sky, from_sky.d, ray.d))
        power = dr.select(sky, power_of_sky, power)
    share = mi.Color3f(1.0)
    if unseen is not None:
        share = dr.select(unseen.is_light(emitter, -ray.d), mi.Color3f(0.0), share)
        if scene.environment() is not None:
            share = dr.select(sky, unseen.sky_share(scene.environment(), -ray.d), share)
    return ray, dr.select(dr.all(dr.isfinite(power)), power * weight, 0.0), share


def _nearer(scene: Any, emitter: Any, ray: Any, place: Any) -> Any:
    """Origins of rays that Mitsuba sampled on emitters, with the offset of `rays.leaving` on surfaces."""
    shape = emitter.get_shape()
    on = shape.sample_position(0.0, place, shape != None)  # noqa: E711 (an array of pointers)
    same = (on.pdf > 0) & (dr.norm(on.p - ray.o) < SAME * (1 + dr.max(dr.abs(ray.o))))
    return dr.select(same, rays.leaving(scene, on.p, on.n, ray.d).o, ray.o)


def _from_environment(scene: Any, place: Any, direction: Any) -> tuple[Any, Any]:
    """Rays from the environment through the scene's bounding sphere.

    Mitsuba 3.9's own `sample_ray` lights a plane under a constant sky 1.6 times too brightly.
    """
    box = scene.bbox()
    centre, radius = mi.Point3f(box.center()), float(dr.norm(box.extents()) / 2) * 1.001
    it = dr.zeros(mi.SurfaceInteraction3f, dr.width(direction))
    it.p = centre
    ds, over_pdf = scene.environment().sample_direction(it, direction)
    disc = mi.warp.square_to_uniform_disk_concentric(place)
    origin = centre + radius * mi.Frame3f(ds.d).to_world(mi.Vector3f(disc.x, disc.y, 1.0))
    return mi.Ray3f(origin, -ds.d), over_pdf * (dr.pi * radius**2)


@dr.syntax
def _trace(scene, sampler, ray, power, count, max_bounces, holes, first=1.0, unseen=None):  # type: ignore[no-untyped-def]
    width = dr.width(power)
    ray = mi.Ray3f(ray)
    power = mi.Color3f(power)
    bounces = dr.zeros(mi.UInt32, width)
    straight = dr.full(mi.Bool, True, width)  # so far only through clear glass
    active = dr.full(mi.Bool, True, width) & (dr.mean(power) > 0)
    ctx = mi.BSDFContext(mi.TransportMode.Importance)
    while active:
        si = rays.intersect(scene, ray, active, holes)
        active &= si.is_valid()
        true_cosine = dr.dot(si.n, -ray.d)
        active &= true_cosine * si.wi.z > 0
        tilt = dr.minimum(dr.abs(si.wi.z) / dr.maximum(dr.abs(true_cosine), 1e-6), STEEPEST)
        count(si, power * tilt * dr.select(straight, first, 1.0), true_cosine < 0, active)
        active &= bounces < max_bounces

        sample, weight = si.bsdf(ray).sample(ctx, si, sampler.next_1d(active), sampler.next_2d(active), active)
        direction = si.to_world(sample.wo)
        true_out = dr.dot(si.n, direction)
        back = dr.minimum(dr.abs(true_out) / dr.maximum(dr.abs(sample.wo.z), 1e-6), STEEPEST)
        scattered = power * weight * (tilt * back)
        survive = dr.minimum(dr.mean(scattered) / dr.mean(power), 1.0)
        active &= (sample.pdf > 0) & (true_out * sample.wo.z > 0) & dr.isfinite(survive)
        active &= sampler.next_1d(active) < survive
        power = dr.select(active, scattered / dr.maximum(survive, 1e-9), 0.0)
        straight &= mi.Bool(False) if unseen is None else unseen.goes_on(si, sample.wo, active & straight)
        ray = rays.leaving(scene, si.p, si.n, direction)
        bounces += 1


def _count(sums: Any, shape: tuple[int, int, int], si: Any, power: Any, far_side: Any, active: Any) -> None:
    sides, height, width = shape
    side = dr.select(far_side, mi.UInt32(1), mi.UInt32(0))
    place = 3 * (side * (height * width) + light_map_texel(si, width, height, active))
    for channel, value in enumerate((power.x, power.y, power.z)):
        dr.scatter_add(sums, mi.UInt64(value + 0.5), place + channel, active & (side < sides))
