"""Paths independent of edits: the light they bring to the pixel's surface, and its tail.

A path leaves the point that a pixel shows and hits surfaces that contribute their equivalent albedos. Lambertian
surfaces scatter by the cosine, which cancels, so the path carries 1 until it sees a light; others scatter by their
baked BRDF over its albedo (`as_baked`). Lights are sampled at every surface and also hit by the path itself, combined
by the balance heuristic (Veach 1997). Uneditable surfaces scatter by their own BRDF, in a slot of albedo 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baked.transport.tails import FIXED, Tails
from lambent.baking.bsdfs.material_plugin import TANGENT_ATTRIBUTE
from lambent.baking.interreflection import directions
from lambent.baking.tracing import rays
from lambent.baking.tracing.rays import vectors
from lambent.baking.tracing.shapes import ObjectNumbers
from lambent.baking.transport.view_points import ViewPoints
from lambent.core.arrays import Floats

NONE = 255  # slot of a side that scatters nothing
COSINE, BAKED, FIXED_BRDF = 0, 1, 2  # how a surface scatters: 1/pi, its baked BRDF over its albedo, its BRDF
WAYS = 2  # a path gets light in two ways: from a sampled light, and from one that it hits


@dataclass(frozen=True)
class Surfaces:
    """The objects of a scene as seen by a path.

    Attributes
    ----------
    scene : mi.Scene
    numbers : ObjectNumbers
    slots : (objects, 2) int
        Slot of each object for reflected and for transmitted light, or NONE.
    scatters : (objects,) uint32
        COSINE, BAKED or FIXED_BRDF.
    factors : (objects, 2 sides, 2, 3) float32
        `as_baked.over_albedo` of each object; for an uneditable one, factors that leave f unchanged.
    names, material : tuple of str, (objects,) int
        Names of the materials, and the index of each object's material.
    """

    scene: Any
    numbers: ObjectNumbers
    slots: np.ndarray
    scatters: np.ndarray
    factors: np.ndarray
    names: tuple[str, ...]
    material: np.ndarray

    @classmethod
    def of(
        cls, scene: Any, numbers: ObjectNumbers, materials: Sequence[str], tails: Tails, shapes: Mapping[str, Floats]
    ) -> Surfaces:
        """Describe objects by their materials; `shapes` as from `as_baked.shapes_of`."""
        number = {slot: k for k, slot in enumerate(tails.slots)}
        edited = {material for material, side in tails.slots if side != FIXED}
        fixed = number.get(("", FIXED), NONE)
        rows = [
            [
                number.get((material, side), NONE) if material in edited else fixed
                for side in ("reflection", "transmission")
            ]
            for material in materials
        ]
        names, material = np.unique(materials, return_inverse=True)
        scatters = [
            (BAKED if name in shapes else COSINE) if name in edited or fixed == NONE else FIXED_BRDF
            for name in materials
        ]
        as_it_is = np.broadcast_to(np.array([[1.0], [0.0]]), (2, 2, 3))
        factors = [shapes[name] if how == BAKED else as_it_is for name, how in zip(materials, scatters, strict=True)]
        return cls(
            scene, numbers, np.array(rows, np.uint32), np.array(scatters, np.uint32),
            np.array(factors, np.float32), tuple(map(str, names)), material,
        )  # fmt: skip


@dataclass
class Second:
    """The second surfaces of paths, if these contribute by bands.

    Attributes
    ----------
    material : mi.UInt32
        Index of the material in `Surfaces.names`.
    wo, wi_lit, wi : mi.Vector3f
        In the surface's frame: directions to the path's origin, to the sampled light, and of the path's continuation.
    """

    material: Any
    wo: Any
    wi_lit: Any
    wi: Any


@dataclass
class Paths:
    """Samples of some points, point after point: sample s of point p has the index p * samples + s.

    Attributes
    ----------
    at : mi.UInt32
        The point of each sample.
    wi : mi.Vector3f
        Direction in the point's frame.
    weight : mi.Float
        1 / density of the direction; 0 if it is to be ignored.
    light : mi.Float
        (entries, n, 4): red, green and blue of paths with 2, 3, ... surfaces, for each of the WAYS, and the bits of the
        tail; if the second surface contributes by bands, of the tail of its first band.
    arrived : mi.UInt32
        Bit e is set if light arrived at entry e; otherwise `light` is undefined there.
    second : Second or None
    """

    points: int
    samples: int
    at: Any
    wi: Any
    weight: Any
    light: Any
    arrived: Any
    second: Second | None


def trace(surfaces: Surfaces, points: ViewPoints, sides: np.ndarray, tails: Tails, samples: int, seed: int) -> Paths:
    """Trace `samples` paths from each point.

    Parameters
    ----------
    sides : (2,)
        Shares of the directions that pass through the surface, and that return to the viewer.
    seed
        The same seed gives the same paths.
    """
    count = len(points)
    width = count * samples
    sampler = rays.independent(seed, width)
    at = dr.arange(mi.UInt32, width) // dr.opaque(mi.UInt32, samples)
    p, flat, wo, t, b, n = (
        dr.gather(mi.Vector3f, vectors(mi.Vector3f, array), at)
        for array in (points.p, points.flat, points.wo, points.t, points.b, points.n)
    )
    shares = directions.Sides(*(dr.opaque(mi.Float, float(share)) for share in sides))
    wi, pdf = directions.sampled(wo, shares, sampler.next_1d(), sampler.next_1d(), sampler.next_2d())
    ray = rays.leaving(surfaces.scene, p, flat, wi.x * t + wi.y * b + wi.z * n)
    # A bent normal can send a direction through the surface that it should leave.
    meant = dr.dot(flat, t * wo.x + b * wo.y + n * wo.z) * wo.z
    passes = dr.dot(flat, ray.d) * meant * wi.z <= 0
    lights = WAYS * (tails.most_hits - 1)
    light = dr.empty(mi.Float, 4 * lights * width)
    orders = [tails.begin(hits) + tails.multisets(hits).number_of_order for hits in range(2, tails.most_hits + 1)]
    slow = bool(tails.second)
    at_second = [dr.zeros(mi.Float, width if slow else 1) for _ in range(9)]
    material = dr.full(mi.UInt32, NONE, width if slow else 1)
    begin = np.cumsum([0, *(len(order) for order in orders)])
    arrived = _follow(
        surfaces.scene, sampler, ray, (pdf > 0) & ~passes, light, surfaces.numbers,
        mi.UInt32(np.ascontiguousarray(surfaces.slots[:, 0])), mi.UInt32(np.ascontiguousarray(surfaces.slots[:, 1])),
        mi.UInt32(np.concatenate(orders).astype(np.uint32)), mi.UInt32(begin.astype(np.uint32)),
        dr.opaque(mi.UInt32, len(tails.slots)), dr.opaque(mi.UInt32, tails.most_hits),
        rays.has_holes(surfaces.scene), bool(surfaces.scatters.any()), mi.UInt32(surfaces.scatters),
        mi.Float(surfaces.factors.ravel()), bool((surfaces.slots[:, 1] != NONE).any()), slow,
        mi.UInt32(surfaces.material.astype(np.uint32)), material, at_second,
    )  # fmt: skip
    weight = dr.select((pdf > 0) & ~passes, dr.rcp(dr.maximum(pdf, 1e-20)), 0.0)
    dr.eval(wi, weight, light, arrived, material, at_second)

    second = Second(material, *(mi.Vector3f(*at_second[k : k + 3]) for k in (0, 3, 6))) if slow else None
    return Paths(count, samples, at, wi, weight, light, arrived, second)


@dr.syntax
def _follow(  # type: ignore[no-untyped-def]
    scene, sampler, ray, active, light, objects, reflect, transmit, numbers, begins, members, most, holes, shaped,
    scatters, factors, sheets, slow, materials, material, at_second,
):  # fmt: skip
    """Write the light of all path lengths, entry WAYS (hits - 2) + way of each sample. Returns bits of what arrived."""
    width = dr.width(ray.o)
    index, stride = dr.arange(mi.UInt32, width), dr.opaque(mi.UInt32, width)  # keeps the width out of the kernel
    throughput = mi.Color3f(1.0)
    depth, order, arrived = mi.UInt32(1), mi.UInt32(0), mi.UInt32(0)
    origin, pdf, direct = dr.zeros(mi.SurfaceInteraction3f, width), mi.Float(0), mi.Bool(False)
    ctx = mi.BSDFContext()
    while active:
        si = rays.intersect(scene, ray, active, holes)
        emitter = si.emitter(scene)
        met = active & (depth > 1)
        ds = mi.DirectionSample3f(scene, si, origin)
        other = scene.pdf_emitter_direction(origin, ds, met & ~direct)
        share = dr.select(direct | (other <= 0), 1.0, pdf / (pdf + other))
        brought = throughput * emitter.eval(si, met) * share
        met &= dr.max(brought) > 0
        entry = WAYS * depth - 3
        put(light, brought, _number(numbers, begins, depth - 1, order, met), entry * stride + index, met)
        arrived |= dr.select(met, 1 << entry, 0)

        active &= si.is_valid() & (depth < most)
        shape = objects.at(si, active)
        slot, slot_through = dr.gather(mi.UInt32, reflect, shape, active), mi.UInt32(NONE)
        if dr.hint(sheets, mode="scalar"):
            slot_through = dr.gather(mi.UInt32, transmit, shape, active)
        at = mi.SurfaceInteraction3f(si)
        at.n = dr.select(dr.dot(si.n, ray.d) > 0, -si.n, si.n)  # orientation used by a guided sky's sampling
        up = mi.Vector3f(si.sh_frame.n)
        up = dr.select(dr.dot(up, ray.d) > 0, -up, up)
        both = (slot != NONE) & (slot_through != NONE)
        through = (slot == NONE) | (both & (sampler.next_1d(active) < 0.5))
        how = mi.UInt32(COSINE)
        if dr.hint(shaped, mode="scalar"):
            how = dr.gather(mi.UInt32, scatters, shape, active)

        by_bands = mi.Bool(False)
        frame = mi.Frame3f(up)
        if dr.hint(slow, mode="scalar"):
            by_bands = (depth == 1) & (how != FIXED_BRDF)
            frame = _brushed(si, up, active & by_bands)
            sides = directions.Sides(dr.select(both, 0.5, dr.select(slot == NONE, 1.0, 0.0)), mi.Float(0.0))
        by_own = (how != COSINE) & ~by_bands

        # A sampled light.
        lit, value = scene.sample_emitter_direction(at, sampler.next_2d(active), False, active)
        cosine = dr.dot(lit.d, up)
        behind = cosine < 0
        slot_lit = dr.select(behind, slot_through, slot)
        f = mi.Color3f(dr.select(slot_lit != NONE, dr.abs(cosine) / dr.pi, 0.0))
        pdf_lit = dr.abs(cosine) / dr.pi * dr.select(both, 0.5, 1.0)
        if dr.hint(shaped, mode="scalar"):
            known, pdf_known = si.bsdf(ray).eval_pdf(ctx, si, si.to_local(lit.d), active & by_own)
            known = _over_albedo(known, factors, shape, behind, active & by_own & (slot_lit != NONE))
            f, pdf_lit = dr.select(by_own, known, f), dr.select(by_own, pdf_known, pdf_lit)
        if dr.hint(slow, mode="scalar"):
            back = frame.to_local(-ray.d)
            seen = frame.to_local(lit.d)
            f = dr.select(by_bands & (slot_lit != NONE), mi.Color3f(1.0), f)
            pdf_lit = dr.select(by_bands, directions.density(seen, back, sides), pdf_lit)
            dr.scatter(material, dr.gather(mi.UInt32, materials, shape), index, active & by_bands)
            for c in range(3):
                dr.scatter(at_second[c], back[c], index, active & by_bands)
                dr.scatter(at_second[3 + c], seen[c], index, active & by_bands)
        wrong = (dr.dot(si.n, lit.d) * dr.dot(si.n, ray.d) > 0) != behind
        shines = active & (lit.pdf > 0) & (dr.max(f) > 0) & (by_own | ~wrong)
        value *= throughput * f * dr.select(lit.delta, 1.0, lit.pdf / (lit.pdf + pdf_lit))
        shines &= dr.max(value) > 0
        shines &= ~rays.hidden(scene, si.p, si.n, lit.p, shines, holes)
        order_lit = _and(order, slot_lit, members, depth, slow)
        number = _number(numbers, begins, depth, order_lit, shines)
        put(light, value, number, (entry + 1) * stride + index, shines)
        arrived |= dr.select(shines, 1 << (entry + 1), 0)

        # The path's continuation.
        local = mi.warp.square_to_cosine_hemisphere(sampler.next_2d(active))
        pdf = local.z / dr.pi * dr.select(both, 0.5, 1.0)
        down = dr.select(through, -1.0, 1.0)
        d = frame.to_world(mi.Vector3f(local.x, local.y, local.z * down))
        active &= (slot != NONE) | (slot_through != NONE)
        active &= by_own | by_bands | (dr.dot(si.n, d) * dr.dot(si.n, ray.d) * down < 0)
        direct = mi.Bool(False)
        throughput *= dr.select(both & ~by_own, 2.0, 1.0)
        slot_on = dr.select(through, slot_through, slot)
        if dr.hint(slow, mode="scalar"):
            wi, density = directions.sampled(
                back, sides, sampler.next_1d(active), sampler.next_1d(active), sampler.next_2d(active)
            )
            d = dr.select(by_bands, frame.to_world(wi), d)
            goes = (density > 0) & (dr.dot(si.n, d) * dr.dot(si.n, ray.d) * wi.z < 0)
            pdf = dr.select(by_bands, density, pdf)
            throughput *= dr.select(by_bands, dr.rcp(dr.maximum(density, 1e-20)) * dr.select(both, 0.5, 1.0), 1.0)
            active &= ~by_bands | goes
            for c in range(3):
                dr.scatter(at_second[6 + c], wi[c], index, active & by_bands)
        if dr.hint(shaped, mode="scalar"):
            bs, weight = si.bsdf(ray).sample(ctx, si, sampler.next_1d(), sampler.next_2d(), active & by_own)
            d = dr.select(by_own, si.to_world(bs.wo), d)
            below = dr.dot(d, up) < 0
            slot_on = dr.select(by_own, dr.select(below, slot_through, slot), slot_on)
            active &= ~by_own | ((bs.pdf > 0) & (slot_on != NONE))
            weight = _over_albedo(weight, factors, shape, below, active & by_own)
            pdf = dr.select(by_own, bs.pdf, pdf)
            direct = by_own & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
            throughput *= dr.select(by_own, weight, mi.Color3f(1.0))
            active &= ~by_own | (dr.max(weight) > 0)
        order = _and(order, slot_on, members, depth, slow)
        origin = mi.SurfaceInteraction3f(at)
        ray = rays.leaving(scene, si.p, si.n, d)
        depth += 1
    return arrived


def _and(order: Any, slot: Any, members: Any, depth: Any, slow: bool) -> Any:
    """Append a slot to the order; a second surface that contributes by bands adds none."""
    longer = order * members + slot
    return dr.select(depth == 1, order, longer) if slow else longer


def _over_albedo(value: Any, factors: Any, shape: Any, below: Any, active: Any) -> Any:
    """f / d from f, or 0 where not `active`: `as_baked.over_albedo`."""
    at = 4 * shape + dr.select(below, mi.UInt32(2), mi.UInt32(0))
    own, brightest = (dr.gather(mi.Color3f, factors, at + k, active) for k in (0, 1))
    return dr.select(own > 0, value * own, dr.sum(value * brightest))


def _brushed(si: Any, up: Any, active: Any) -> Any:
    """The shading frame of interactions, on the viewer's side."""
    t = si.bsdf().eval_attribute_3(TANGENT_ATTRIBUTE, si, active)
    t = mi.Vector3f(t.x, t.y, t.z)
    t -= up * dr.dot(up, t)
    frame = mi.Frame3f(up)
    t = dr.select(dr.squared_norm(t) > 1e-8, dr.normalize(t), frame.s)
    frame.s, frame.t = t, dr.cross(up, t)
    return frame


def _number(numbers: Any, begins: Any, met: Any, order: Any, active: Any) -> Any:
    """Number of the tail for this number of surfaces in this order."""
    return dr.gather(mi.UInt32, numbers, dr.gather(mi.UInt32, begins, met - 1, active) + order, active)


def put(numbers: Any, value: Any, bits: Any, at: Any, active: Any = True) -> None:
    """Write rows of three numbers and 32 bits, with one store each, into (n, 4) `numbers`."""
    bits = dr.reinterpret_array(mi.Float, mi.UInt32(bits))
    dr.scatter(numbers, mi.Vector4f(value[0], value[1], value[2], bits), at, active)
