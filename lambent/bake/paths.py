"""Path tracing: radiance along rays and irradiance at points, one vectorised loop for every bake.

Multiple importance sampling between emitter sampling and BSDF sampling (Veach 1997, balance heuristic), Russian
roulette from the second bounce on. The path starts at a vertex the caller has sampled, of whose density it tells.

Where a texture says that there is no surface (`eval_null_transmission` of the BSDF), rays go on as if nothing were
there, those to emitters too. An emitter is sampled as if it had no holes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

ROULETTE_DEPTH = 2
OFFSET = 1e-5  # metres, and share of the largest coordinate, over a surface from where rays leave it
OFFSET_OF_SCENE = 1e-7  # likewise, of the scene's diagonal: rays over a triangle of 1 km meet it from 30 micrometres
SHADOW_SHORT = 9e-4  # share of a ray to an emitter that it ends before it, Mitsuba's own
Cache = Callable[[Any, Any], Any]  # (surface interaction, active) -> diffuse radiance towards the ray's origin


@dataclass
class Start:
    """Where paths start: `ray`, the interaction it leaves, and the density it was sampled with.

    pdf (sr^-1) is that of the direction, for weighting emitters it meets; `direct` is whether such emitters count in
    full, because nothing else samples them.
    """

    ray: Any
    origin: Any
    pdf: Any
    direct: bool


def camera_start(ray: Any) -> Start:
    """Start of paths that nothing samples but the camera."""
    return Start(ray, dr.zeros(mi.SurfaceInteraction3f, dr.width(ray.o)), mi.Float(1.0), True)


def radiance(scene: Any, sampler: Any, start: Start, max_depth: int, cache: Cache | None = None) -> Any:
    """Radiance (mi.Color3f) that arrives along rays, W/(sr m^2).

    Parameters
    ----------
    max_depth : int
        Vertices on a path, the last emitter not counted: 1 sees emitters and, with a cache, diffuse surfaces.
    cache : callable, optional
        Diffuse radiance at a surface from baked light; the scene's materials must then be without diffuse terms.
    """
    return _trace(
        scene, sampler, mi.Ray3f(start.ray), mi.SurfaceInteraction3f(start.origin), mi.Float(start.pdf),
        mi.Bool(start.direct), max_depth, cache or _nothing, has_holes(scene),
    )  # fmt: skip


def _nothing(si: Any, active: Any) -> Any:
    return mi.Color3f(0.0)


def has_holes(scene: Any) -> bool:
    """Whether a shape of the scene has holes; where none has, nothing is spent on looking for them."""
    return any(mi.has_flag(shape.bsdf().flags(), mi.BSDFFlags.Null) for shape in scene.shapes())


def intersect(scene: Any, ray: Any, active: Any, holes: bool) -> Any:
    """What a ray meets behind all holes; `si.t` counts from the last of them. `holes` is `has_holes(scene)`."""
    if not holes:
        return scene.ray_intersect(ray, active)
    return _behind_holes(scene, mi.Ray3f(ray), mi.Bool(active))


def leaving(scene: Any, p: Any, n: Any, direction: Any) -> Any:
    """Rays that leave points p of surfaces of normals n, on the side of `direction`.

    They start a ninth as far off as Mitsuba's do, where those miss the foot of what stands on a surface.
    """
    box = scene.bbox()
    size = float(dr.norm(box.extents())) if box.valid() else 0.0
    above = OFFSET * (1 + dr.max(dr.abs(p))) + dr.opaque(mi.Float, OFFSET_OF_SCENE * size)
    return mi.Ray3f(p + n * dr.mulsign(above, dr.dot(n, direction)), direction)


def _towards(scene: Any, si: Any, target: Any) -> Any:
    """Rays from surfaces that end just before a point elsewhere."""
    start = leaving(scene, si.p, si.n, target - si.p).o
    way = target - start
    distance = dr.norm(way)
    ray = mi.Ray3f(start, way / distance)
    ray.maxt = distance * (1 - SHADOW_SHORT)
    return ray


def _is_hole(si: Any, active: Any) -> Any:
    found = active & si.is_valid()
    return found & (si.bsdf().eval_null_transmission(si, found)[0] > 0.5)


@dr.syntax
def _behind_holes(scene, ray, active):  # type: ignore[no-untyped-def]
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(ray.o))
    si.t = dr.full(mi.Float, dr.inf, dr.width(ray.o))  # nothing is met where `active` is false
    again = active
    while again:
        si = scene.ray_intersect(ray, again)
        ray = leaving(scene, si.p, si.n, ray.d)
        again = _is_hole(si, again)
    return si


def sample_emitter(scene: Any, si: Any, u: Any, active: Any, holes: bool) -> tuple[Any, Any]:
    """DirectionSample3f of Mitsuba's `sample_emitter_direction`, and what arrives over its density, 0 in shadow."""
    ds, value = scene.sample_emitter_direction(si, u, False, active)
    lit = active & (ds.pdf > 0)
    lit &= ~hidden(scene, si, ds, lit, holes)
    return ds, dr.select(lit, value, 0.0)


def hidden(scene: Any, si: Any, ds: Any, active: Any, holes: bool) -> Any:
    """Whether anything without a hole stands between `si` and the point that an emitter was sampled at."""
    ray = _towards(scene, si, ds.p)
    return _blocked(scene, ray, mi.Point3f(ds.p), mi.Bool(active)) if holes else scene.ray_test(ray, active)


def in_shadow(scene: Any, ray: Any, active: Any, holes: bool) -> Any:
    """Whether anything without a hole stands in the way of a ray. `holes` is `has_holes(scene)`."""
    if not holes:
        return scene.ray_test(ray, active)
    return intersect(scene, ray, active, True).is_valid()


@dr.syntax
def _blocked(scene, ray, target, active):  # type: ignore[no-untyped-def]
    blocked = mi.Bool(False)
    again = active
    while again:
        si = scene.ray_intersect(ray, again)
        ray = _towards(scene, si, target)
        blocked = si.is_valid()
        again = _is_hole(si, again)
    return blocked


@dr.syntax
def _trace(scene, sampler, ray, origin, pdf, direct, max_depth, cache, holes):  # type: ignore[no-untyped-def]
    width = dr.width(ray.o)
    result = dr.zeros(mi.Color3f, width)
    throughput = dr.ones(mi.Color3f, width)
    depth = dr.zeros(mi.UInt32, width)
    active = dr.full(mi.Bool, True, width)
    ctx = mi.BSDFContext()
    while active:
        si = intersect(scene, ray, active, holes)
        ds = mi.DirectionSample3f(scene, si, origin)
        emitter = si.emitter(scene)
        pdf_emitter = scene.pdf_emitter_direction(origin, ds, active & ~direct)
        weight = dr.select(direct, 1.0, _balance(pdf, pdf_emitter))
        result += dr.select(active, throughput * emitter.eval(si, active) * weight, 0.0)
        active &= si.is_valid() & (depth < max_depth)
        result += dr.select(active, throughput * cache(si, active), 0.0)

        at = mi.SurfaceInteraction3f(si)  # whose normal is on the ray's side: a guided sky asks which side is lit
        at.n = dr.select(dr.dot(si.n, ray.d) > 0, -si.n, si.n)
        bsdf = si.bsdf(ray)
        lit = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        ds, value = scene.sample_emitter_direction(at, sampler.next_2d(active), False, lit)
        lit &= ds.pdf > 0
        wo = si.to_local(ds.d)
        f, pdf_bsdf, sample, f_sample = bsdf.eval_pdf_sample(
            ctx, si, wo, sampler.next_1d(active), sampler.next_2d(active), active
        )
        weight = dr.select(ds.delta, 1.0, _balance(ds.pdf, pdf_bsdf))
        brought = throughput * f * value * weight
        lit &= dr.max(brought) > 0  # a narrow lobe sees few emitters: no ray is spent on the shadows of the others
        lit &= ~hidden(scene, si, ds, lit, holes)
        result += dr.select(lit, brought, 0.0)

        throughput *= f_sample
        origin = mi.SurfaceInteraction3f(at)
        pdf = mi.Float(sample.pdf)
        direct = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)
        ray = leaving(scene, si.p, si.n, si.to_world(sample.wo))
        depth += 1
        brightest = dr.max(throughput)
        active &= (brightest > 0) & (pdf > 0)
        survive = dr.select(depth >= ROULETTE_DEPTH, dr.minimum(brightest, 0.95), 1.0)
        active &= sampler.next_1d(active) < survive
        throughput *= dr.rcp(dr.maximum(survive, 1e-6))
    return result


def _balance(a: Any, b: Any) -> Any:
    return dr.select(a > 0, a / (a + b), 0.0)


@dataclass
class Points:
    """Points on surfaces, one per thread: position, shading normal and triangle normal on the lit side."""

    position: Any
    normal: Any
    flat: Any


def irradiance(
    scene: Any, sampler: Any, points: Points, u_bsdf: Any, u_emitter: Any, max_depth: int, cache: Cache | None = None
) -> Any:
    """One sample of irradiance (mi.Color3f) at each point, W/m^2, all bounces.

    Parameters
    ----------
    u_bsdf, u_emitter : mi.Point2f
        In [0, 1)^2: they choose a cosine distributed direction and a point on an emitter. Stratify them.
    max_depth, cache
        As `radiance` takes them.
    """
    (found, _), (aimed, _) = _contributions(scene, sampler, points, u_bsdf, u_emitter, max_depth, cache)
    return found + aimed


def moment(
    scene: Any, sampler: Any, points: Points, u_bsdf: Any, u_emitter: Any, max_depth: int, cache: Cache | None = None
) -> Any:
    """One sample of the sum of directions (as mi.Color3f), each times the luminance that it adds to `irradiance`."""
    both = _contributions(scene, sampler, points, u_bsdf, u_emitter, max_depth, cache)
    return mi.Color3f(sum(mi.luminance(light) * mi.Vector3f(direction) for light, direction in both))


def _contributions(
    scene: Any, sampler: Any, points: Points, u_bsdf: Any, u_emitter: Any, max_depth: int, cache: Cache | None
) -> tuple[tuple[Any, Any], tuple[Any, Any]]:
    """What a direction of the cosine's adds to the irradiance, and what one to an emitter does, with the directions."""
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(points.position))
    si.p, si.n, si.sh_frame = points.position, mi.Normal3f(points.flat), mi.Frame3f(mi.Normal3f(points.normal))
    local = mi.warp.square_to_cosine_hemisphere(u_bsdf)
    ray = leaving(scene, si.p, si.n, si.to_world(local))
    arriving = radiance(scene, sampler, Start(ray, si, local.z / dr.pi, False), max_depth, cache)
    ds, value = sample_emitter(scene, si, u_emitter, mi.Bool(True), has_holes(scene))
    cosine = dr.maximum(dr.dot(ds.d, points.normal), 0.0)
    weight = dr.select(ds.delta, 1.0, _balance(ds.pdf, cosine / dr.pi))
    direct = dr.select(ds.pdf > 0, value * cosine * weight, 0.0)
    return (dr.pi * arriving, ray.d), (direct, ds.d)
