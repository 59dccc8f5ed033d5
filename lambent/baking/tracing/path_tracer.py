"""Path tracing: radiance along rays and irradiance at points, one vectorised loop for every bake.

Multiple importance sampling of emitters and BSDFs (Veach 1997, balance heuristic), Russian roulette from the second
bounce on. The path starts at a vertex sampled by the caller, with its density.

Paths and shadow rays pass through holes of surfaces (`rays`). Emitters are sampled as if they had no holes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import drjit as dr
import mitsuba as mi

from lambent.baking.tracing import rays
from lambent.baking.tracing.lights.lit_texels import LitTexels
from lambent.baking.tracing.lights.sun import Sun, Unseen

ROULETTE_DEPTH = 2
Cache = Callable[[Any, Any], Any]  # (surface interaction, active) -> diffuse radiance towards the ray's origin


class Tally(Protocol):
    """Sums (mi.Color3f) of the light that paths bring: a single one, or one per group of emitters.

    The first `count` sums add up to all light; others are parts of these.
    """

    count: int

    def begin(self, width: int) -> list[Any]:
        """Zero sums."""
        ...

    def emitted(self, sums: list[Any], light: Any, emitter: Any, w: Any, factor: Any, first: Any) -> list[Any]:
        """Add `light` of emitters (mi.EmitterPtr), straight from them where `first`.

        It is their radiance from the unit directions w, times `factor`, unless their sun is left out: then `factor` is
        0.
        """
        ...

    def cached(self, sums: list[Any], throughput: Any, cache: Any, si: Any, active: Any, first: Any) -> list[Any]:
        """Add the light of a cache at surfaces, which are the path's first ones where `first`."""
        ...


class AllLight:
    """One sum of all light; a cache is a `Cache`, or None. With `direct`, another sum without the cache's light."""

    count = 1

    def __init__(self, *, direct: bool = False) -> None:
        self._direct = direct

    def begin(self, width: int) -> list[Any]:
        return [dr.zeros(mi.Color3f, width) for _ in range(1 + self._direct)]

    def emitted(self, sums: list[Any], light: Any, emitter: Any, w: Any, factor: Any, first: Any) -> list[Any]:
        return [total + light for total in sums]

    def cached(self, sums: list[Any], throughput: Any, cache: Any, si: Any, active: Any, first: Any) -> list[Any]:
        if cache is None:
            return sums
        return [sums[0] + dr.select(active, throughput * cache(si, active), 0.0), *sums[1:]]


@dataclass
class Start:
    """Start of paths: `ray`, the interaction it leaves, and the density of its direction, pdf (sr^-1).

    The density weights the emitters that the ray hits; `direct` counts them in full, if nothing else samples them. The
    ray does not see the sun `unseen`. If that sun passes panes, clear glass is ignored until the path scatters:
    everything that a ray sees straight through glass is emitter-sampled from the start. Only `active` paths are traced.
    Where it meets `lit` texels, light is shared with rays to these. Such rays have the texels' numbers as `chosen`,
    see no emitters, and are divided by the density of both kinds.
    """

    ray: Any
    origin: Any
    pdf: Any
    direct: bool
    unseen: Unseen | None = None
    active: Any = True
    lit: LitTexels | None = None
    chosen: Any = None


def camera_start(ray: Any) -> Start:
    """Start of paths from a camera, whose first rays nothing else samples."""
    return Start(ray, dr.zeros(mi.SurfaceInteraction3f, dr.width(ray.o)), mi.Float(1.0), True)


def radiance(scene: Any, sampler: Any, start: Start, max_depth: int, cache: Cache | None = None) -> Any:
    """Radiance (mi.Color3f) that arrives along rays, W/(sr m^2).

    Parameters
    ----------
    max_depth : int
        Vertices on a path, excluding the last emitter: 1 sees emitters and, with a cache, diffuse surfaces.
    cache : callable, optional
        Diffuse radiance at a surface from baked light; the scene's materials must then have no diffuse terms.
    """
    return radiance_sums(scene, sampler, start, max_depth, cache, AllLight())[0]


def radiance_sums(scene: Any, sampler: Any, start: Start, max_depth: int, cache: Any, tally: Tally) -> list[Any]:
    """Likewise as the sums of a tally, with a cache that suits it."""
    found: list[Any] = _trace(
        scene, sampler, mi.Ray3f(start.ray), mi.SurfaceInteraction3f(start.origin), mi.Float(start.pdf),
        mi.Bool(start.direct), max_depth, cache, rays.has_holes(scene), start.unseen, tally, start.active,
        start.lit, start.chosen,
    )  # fmt: skip
    return found


def sample_emitter(
    scene: Any, lights: Any, si: Any, u: Any, active: Any, holes: bool, unseen: Unseen | None = None
) -> tuple[Any, Any]:
    """DirectionSample3f of an emitter of the mi.Scene `lights`, and its light over its density, 0 in shadow.

    Light of the sun `unseen` is left out; if that sun passes panes, all other light does too.
    """
    ds, value = lights.sample_emitter_direction(si, u, False, active)
    lit = active & (ds.pdf > 0)
    if isinstance(unseen, Sun) and unseen.first is None:
        value = dr.select(lit, unseen.left_out(ds, value), 0.0)
    if unseen is not None and unseen.passes_panes:
        return ds, dr.select(lit, value, 0.0) * rays.passed_from(scene, si.p, si.n, ds.p, lit)
    lit &= ~rays.hidden(scene, si.p, si.n, ds.p, lit, holes)
    return ds, dr.select(lit, value, 0.0)


@dr.syntax
def _trace(scene, sampler, ray, origin, pdf, direct, max_depth, cache, holes, unseen, tally, active, sent, to):  # type: ignore[no-untyped-def]
    width = dr.width(ray.o)
    sums = tally.begin(width)
    throughput = dr.ones(mi.Color3f, width)
    straight = dr.full(mi.Bool, unseen is not None, width)  # so far only through clear glass
    depth = dr.zeros(mi.UInt32, width)
    active = mi.Bool(active) & dr.full(mi.Bool, True, width)
    ctx = mi.BSDFContext()
    while active:
        si = rays.intersect(scene, ray, active, holes)
        ds = mi.DirectionSample3f(scene, si, origin)
        emitter = si.emitter(scene)
        pdf_emitter = scene.pdf_emitter_direction(origin, ds, active & ~direct)
        if unseen is not None and unseen.first is not None:
            pdf_emitter = dr.select(straight, unseen.first.pdf(origin, ds, depth == 0, active & straight), pdf_emitter)
        weight = dr.select(direct, 1.0, _balance(pdf, pdf_emitter))
        if to is not None:
            weight = dr.select(depth == 0, 0.0, weight)
        light = emitter.eval(si, active)
        if unseen is not None:
            light -= dr.select(straight & ~si.is_valid(), unseen.radiance(ray.d), 0.0)
        factor = throughput * weight
        brought = dr.select(active, factor * light, 0.0)
        shows_sun = active if unseen is None else active & ~(straight & ~si.is_valid())
        factor = dr.select(shows_sun, factor, 0.0)
        sums = tally.emitted(sums, brought, emitter, ray.d, factor, straight | (depth == 0))
        active &= si.is_valid() & (depth < max_depth)
        if sent is not None:
            texel, others = sent.met(origin.p, si, active & (depth == 0))
            if to is None:
                throughput *= dr.select(others > 0, _balance(pdf, others), 1.0)
            else:
                active &= (depth > 0) | (texel == to)
                throughput *= dr.select(depth == 0, dr.rcp(pdf + others), 1.0)
        sums = tally.cached(sums, throughput, cache, si, active, depth == 0)

        at = mi.SurfaceInteraction3f(si)  # oriented to the ray's side, for sampling a guided sky
        at.n = dr.select(dr.dot(si.n, ray.d) > 0, -si.n, si.n)
        bsdf = si.bsdf(ray)
        lit = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        ds, value = scene.sample_emitter_direction(at, sampler.next_2d(active), False, lit)
        lit &= ds.pdf > 0
        wo = si.to_local(ds.d)
        if unseen is not None:
            lit &= ~unseen.goes_on(si, wo, lit & straight)
        f, pdf_bsdf, sample, f_sample = bsdf.eval_pdf_sample(
            ctx, si, wo, sampler.next_1d(active), sampler.next_2d(active), active
        )
        weight = dr.select(ds.delta, 1.0, _balance(ds.pdf, pdf_bsdf))
        brought = throughput * f * value * weight
        lit &= dr.max(brought) > 0  # a narrow lobe sees few emitters; the others need no shadow rays
        lit &= ~rays.hidden(scene, si.p, si.n, ds.p, lit, holes)
        brought = dr.select(lit, brought, 0.0)
        factor = dr.select(lit, throughput * f * weight * dr.rcp(ds.pdf), 0.0)
        sums = tally.emitted(sums, brought, ds.emitter, ds.d, factor, mi.Bool(False))

        straight &= mi.Bool(False) if unseen is None else unseen.goes_on(si, sample.wo, active & straight)
        throughput *= f_sample
        origin = dr.select(straight, origin, at)
        direct = dr.select(straight, direct, mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta))
        ray = rays.leaving(scene, si.p, si.n, dr.select(straight, ray.d, si.to_world(sample.wo)))
        pdf = dr.select(straight, pdf, sample.pdf)
        depth += 1
        brightest = dr.max(throughput)
        active &= (brightest > 0) & (sample.pdf > 0)
        survive = dr.select(depth >= ROULETTE_DEPTH, dr.minimum(brightest, 0.95), 1.0)
        active &= sampler.next_1d(active) < survive
        throughput *= dr.rcp(dr.maximum(survive, 1e-6))
    return sums


def _balance(a: Any, b: Any) -> Any:
    return dr.select(a > 0, a / (a + b), 0.0)


@dataclass
class Points:
    """Points on surfaces, one per thread: position, shading normal and triangle normal on the lit side."""

    position: Any
    normal: Any
    flat: Any


def irradiance(
    scene: Any, sampler: Any, points: Points, u_bsdf: Any, u_emitter: Any, max_depth: int, cache: Cache | None = None,
    unseen: Unseen | None = None,
) -> Any:  # fmt: skip
    """One sample of irradiance (mi.Color3f) at each point, W/m^2, all bounces.

    Parameters
    ----------
    u_bsdf, u_emitter : mi.Point2f
        In [0, 1)^2, for a cosine-distributed direction and a point on an emitter; to be stratified.
    max_depth, cache
        As in `radiance`.
    unseen : Unseen, optional
        Sun whose direct light is left out, including light straight through clear glass.
    """
    return irradiance_sums(scene, sampler, points, u_bsdf, u_emitter, max_depth, cache, AllLight(), unseen)[0]


def irradiance_sums(
    scene: Any, sampler: Any, points: Points, u_bsdf: Any, u_emitter: Any, max_depth: int, cache: Any, tally: Tally,
    unseen: Unseen | None = None, lit: LitTexels | None = None,
) -> list[Any]:  # fmt: skip
    """Likewise as the sums of a tally, with a cache that suits it; with `lit`, `of_lit` adds the rest."""
    parts = _contributions(scene, sampler, points, u_bsdf, u_emitter, max_depth, cache, tally, unseen, True, lit)
    (along, _), (direct, _) = parts
    return [mi.Color3f(one + other) for one, other in zip(along, direct, strict=True)]


def direct(scene: Any, points: Points, sampler: Any, unseen: Unseen | None = None) -> Any:
    """One sample of irradiance (mi.Color3f) at each point, W/m^2, straight from emitters that are not `unseen`."""
    ds, value = _first_emitter(scene, _at(points), sampler.next_2d(), mi.Bool(True), unseen)
    return value * dr.maximum(dr.dot(ds.d, points.normal), 0.0)


def _first_emitter(scene: Any, si: Any, u: Any, active: Any, unseen: Unseen | None) -> tuple[Any, Any]:
    """`sample_emitter` at the start of a path."""
    first = None if unseen is None else unseen.first
    lights = scene if first is None else first.scene
    return sample_emitter(scene, lights, si, u, active, rays.has_holes(scene), unseen)


def of_lit(
    scene: Any, sampler: Any, points: Points, u: Any, max_depth: int, cache: Any, tally: Tally, unseen: Unseen | None,
    lit: LitTexels,
) -> list[Any]:  # fmt: skip
    """What one path of each point by way of a lit texel, chosen by u (mi.Point2f), adds to `irradiance_sums`."""
    si = _at(points)
    ray, chosen = lit.ray(scene, si.p, si.n, u.x, mi.Point2f(u.y, sampler.next_1d()))
    cosine = dr.maximum(dr.dot(ray.d, points.normal), 0.0)
    start = Start(ray, si, cosine / dr.pi, False, unseen, cosine > 0, lit, chosen)
    return [mi.Color3f(cosine * one) for one in radiance_sums(scene, sampler, start, max_depth, cache, tally)]


def _at(points: Points) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(points.position))
    si.p, si.n, si.sh_frame = points.position, mi.Normal3f(points.flat), mi.Frame3f(mi.Normal3f(points.normal))
    return si


def arriving(
    scene: Any, sampler: Any, points: Points, u_bsdf: Any, u_emitter: Any, max_depth: int, cache: Any, tally: Tally,
    unseen: Unseen | None = None, active: Any = True,
) -> list[tuple[Any, Any]]:  # fmt: skip
    """Likewise by direction: irradiances (mi.Color3f) that add up to the sample, and unit directions they come from.

    The tally has one sum.
    """
    parts = _contributions(scene, sampler, points, u_bsdf, u_emitter, max_depth, cache, tally, unseen, active)
    return [(mi.Color3f(sums[0]), mi.Vector3f(w)) for sums, w in parts]


def moment(
    scene: Any, sampler: Any, points: Points, u_bsdf: Any, u_emitter: Any, max_depth: int, cache: Cache | None = None,
    unseen: Unseen | None = None,
) -> Any:  # fmt: skip
    """One sample of the sum of directions (as mi.Color3f), each weighted by its luminance in `irradiance`."""
    found = arriving(scene, sampler, points, u_bsdf, u_emitter, max_depth, cache, AllLight(), unseen)
    return mi.Color3f(sum(mi.luminance(light) * w for light, w in found))


def _contributions(
    scene: Any, sampler: Any, points: Points, u_bsdf: Any, u_emitter: Any, max_depth: int, cache: Any, tally: Tally,
    unseen: Unseen | None, active: Any = True, lit: LitTexels | None = None,
) -> list[tuple[list[Any], Any]]:  # fmt: skip
    """Sums of irradiance by sampling of directions, and by emitters, each with the directions it comes from."""
    si = _at(points)
    local = mi.warp.square_to_cosine_hemisphere(u_bsdf)
    ray = rays.leaving(scene, si.p, si.n, si.to_world(local))
    start = Start(ray, si, local.z / dr.pi, False, unseen, active, lit)
    along = radiance_sums(scene, sampler, start, max_depth, cache, tally)
    ds, value = _first_emitter(scene, si, u_emitter, mi.Bool(active), unseen)
    cosine = dr.maximum(dr.dot(ds.d, points.normal), 0.0)
    weight = dr.select(ds.delta, 1.0, _balance(ds.pdf, cosine / dr.pi))
    brought = dr.select(ds.pdf > 0, cosine * weight, 0.0)
    shows_sun = mi.Bool(unseen is None) & (ds.pdf > 0)
    factor = mi.Color3f(dr.select(shows_sun, brought * dr.rcp(ds.pdf), 0.0))
    sums = tally.begin(dr.width(points.position))
    direct = tally.emitted(sums, brought * value, ds.emitter, ds.d, factor, mi.Bool(True))
    return [([dr.pi * one for one in along], ray.d), (direct, ds.d)]
