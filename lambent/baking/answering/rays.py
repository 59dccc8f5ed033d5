"""Where cosine distributed rays from texels end: on a diffuse surface, those that lobes have sent on included.

At every surface a ray ends or follows a lobe, as chance has it: weights are such that sums over many rays are right
whatever the diffuse albedos are. So every ray ends on one surface and can be stored as one number and one weight. The
scatter of lobes is that of the bake.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.bsdfs.diffuse_shares import DiffuseShares
from lambent.baking.bsdfs.material_plugin import DIFFUSE_ATTRIBUTE
from lambent.baking.light.sampling import points_of
from lambent.baking.surfaces.texels import POINTS, Sides
from lambent.baking.tracing import rays
from lambent.baking.tracing.rays import independent
from lambent.baking.tracing.scene_builder import light_map_texel
from lambent.baking.tracing.traced_scene import TracedScene
from lambent.core.arrays import Floats, Indices
from lambent.core.geometry.sequences import hammersley
from lambent.core.light.colour import luminance
from lambent.materials.document import Material

NOWHERE = 0xFFFFFFFF  # of rays that leave the scene
DEPTH = 6  # surfaces whose lobes a ray follows
LEAST_DIFFUSE = 0.1  # of the albedo that rays choose by: surfaces without a diffuse colour may get one
RAYS_AT_ONCE = 1 << 21
TURN = 0.6180339887  # of the points of a texel, from ray to ray: the golden ratio keeps clear of the rays' directions


class RayEnds:
    """Rays through the scene without diffuse terms, as final gathering traces them."""

    def __init__(self, traced: TracedScene) -> None:
        builder = traced.builder(diffuse=False)
        self._whole, self._numbers = traced.whole(diffuse=False), builder.numbers
        self._size = traced.texels.width, traced.texels.height
        looks = dict(builder.scene.materials) | dict.fromkeys(builder.measured, Material())
        materials = [looks[o.material] for o in builder.scene.objects]
        diffuse = np.array([float(luminance(np.array(m.kd)) + luminance(np.array(m.kt_d))) for m in materials])
        self._diffuse = mi.Float(np.maximum(diffuse, LEAST_DIFFUSE).astype(np.float32))
        self._shares = DiffuseShares(materials)
        self._textured = any(t.diffuse for t in builder.scene.textures.values())

    def from_texels(self, sides: Sides, mine: Indices, count: int, seed: int) -> tuple[NDArray[np.uint32], Floats]:
        """Ends (n, count) of rays from texels `mine` (n,) or groups of texels (n, m) of a side, and their weights.

        Rays of a group start at all of its texels, so that they stand for its mean. An end is twice the texel of the
        light map (row * width + column), plus 1 on the other side of the surface.
        A weight is that of the exitance there, with the texture but without its material's albedo.
        """
        spots, weights = np.empty((len(mine), count), np.uint32), np.empty((len(mine), count), np.float32)
        at_once = max(1, RAYS_AT_ONCE // count)
        for number, first in enumerate(range(0, len(mine), at_once)):
            part = slice(first, first + at_once)
            spots[part], weights[part] = self._pass(sides, mine[part], count, (seed, number))
        return spots, weights

    def distance_in_texels(self, sides: Sides, mine: Indices, count: int, seed: int) -> Floats:
        """Harmonic means (n,) of the distances from texels `mine` (n,) along `count` rays, in sizes of the texel."""
        found, at_once = np.zeros(len(mine)), max(1, RAYS_AT_ONCE // count)
        for number, first in enumerate(range(0, len(mine), at_once)):
            part = slice(first, first + at_once)
            ray = self._leaving(sides, mine[part], count, np.random.default_rng((seed, number)))
            far = rays.distances(self._whole, ray).reshape(-1, count)
            found[part] = 1 / np.maximum((1 / np.maximum(far, 1e-9)).mean(axis=1), 1e-9)
        return np.asarray(found / np.maximum(sides.texels.spacing[mine], 1e-9))

    def _pass(self, sides: Sides, mine: Indices, count: int, seed: tuple[int, int]) -> tuple[Any, Any]:
        rng, n = np.random.default_rng(seed), len(mine)
        ray = self._leaving(sides, mine, count, rng)
        sampler = independent(int(rng.integers(1 << 32)), n * count)
        spot, weight = _followed(
            self._whole, sampler, mi.Ray3f(ray), self._numbers, self._diffuse, self._shares, self._size,
            self._textured, rays.has_holes(self._whole),
        )  # fmt: skip
        weight = dr.select(dr.isfinite(weight), weight, 0.0)
        dr.eval(spot, weight)
        return np.array(spot).reshape(n, count), np.array(weight).reshape(n, count)

    def _leaving(self, sides: Sides, mine: Indices, count: int, rng: np.random.Generator) -> Any:
        """Cosine distributed rays (n * count,) from texels `mine` (n,) or groups (n, m), stratified by each."""
        points, n = points_of(sides, mine.reshape(-1)), len(mine)
        thread = dr.arange(mi.UInt32, n * count)
        per_texel = dr.opaque(mi.UInt32, count)  # a constant count would compile another kernel
        texel, k = thread // per_texel, thread % per_texel
        origins = dr.opaque(mi.UInt32, POINTS * (mine.size // max(n, 1)))
        turn = dr.gather(mi.Float, mi.Float(rng.random(n, dtype=np.float32)), texel) + mi.Float(k) * TURN
        point = texel * origins + dr.minimum(mi.UInt32((turn - dr.floor(turn)) * mi.Float(origins)), origins - 1)
        p, normal, flat = (dr.gather(mi.Vector3f, v, point) for v in (points.position, points.normal, points.flat))
        shifts = rng.random((2, n), dtype=np.float32)
        pairs = zip(hammersley(count).T.astype(np.float32), shifts, strict=True)
        u = [dr.gather(mi.Float, mi.Float(of), k) + dr.gather(mi.Float, mi.Float(shift), texel) for of, shift in pairs]
        local = mi.warp.square_to_cosine_hemisphere(mi.Point2f(u[0] - dr.floor(u[0]), u[1] - dr.floor(u[1])))
        return rays.leaving(self._whole, p, mi.Normal3f(flat), mi.Frame3f(mi.Normal3f(normal)).to_world(local))


@dr.syntax
def _followed(scene, sampler, ray, numbers, diffuse, shares, size, textured, holes):  # type: ignore[no-untyped-def]
    width = dr.width(ray.o)
    spot = dr.full(mi.UInt32, NOWHERE, width)
    weight, throughput = dr.zeros(mi.Float, width), dr.ones(mi.Float, width)
    depth, active = dr.zeros(mi.UInt32, width), dr.full(mi.Bool, True, width)
    ctx = mi.BSDFContext()
    while active:
        si = rays.intersect(scene, ray, active, holes)
        active &= si.is_valid()
        number = numbers.at(si, active)
        bsdf, cosine = si.bsdf(ray), mi.Frame3f.cos_theta(si.wi)
        sample, value = bsdf.sample(ctx, si, sampler.next_1d(active), sampler.next_2d(active), active)
        sent = dr.select((sample.pdf > 0) & (depth < DEPTH), mi.luminance(value), 0.0)
        sent = dr.select(dr.isfinite(sent), sent, 0.0)
        ending = dr.gather(mi.Float, diffuse, number, active)
        goes_on = active & (sampler.next_1d(active) * (sent + ending) < sent)
        ends = active & ~goes_on
        shown = shares.seen(number, dr.abs(cosine), active)
        if textured:
            shown *= mi.luminance(mi.Color3f(bsdf.eval_attribute_3(DIFFUSE_ATTRIBUTE, si, active)))
        texel = light_map_texel(si, size[0], size[1], active) * 2 + dr.select(cosine < 0, mi.UInt32(1), mi.UInt32(0))
        spot = dr.select(ends, texel, spot)
        weight = dr.select(ends, throughput * shown * (sent + ending) / ending, weight)
        throughput *= dr.select(goes_on, sent + ending, 1.0)
        ray = rays.leaving(scene, si.p, si.n, si.to_world(sample.wo))
        depth += 1
        active &= goes_on
    return spot, weight
