"""What probes see of the light map: the texel in each direction, its texture, and the sun on it."""

from __future__ import annotations

from collections.abc import Set
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baked.answering.stored import NO_SPOT
from lambent.baking.bsdfs.diffuse_shares import DiffuseShares
from lambent.baking.bsdfs.material_plugin import DIFFUSE_ATTRIBUTE
from lambent.baking.tracing import rays
from lambent.baking.tracing.lights.sun import SunRays
from lambent.baking.tracing.rays import array_of, rays_from
from lambent.baking.tracing.scene_builder import light_map_texel
from lambent.baking.tracing.traced_scene import TracedScene
from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import face_directions
from lambent.core.geometry.directions import normalize
from lambent.materials.document import Material

MOST_OWN = 64  # surfaces of its own object that a ray of a probe passes


class ProbeEyes:
    """Rays from the centres of probes through the middles of their texels."""

    def __init__(self, traced: TracedScene) -> None:
        builder = self._builder = traced.builder(diffuse=False)
        self._whole, self._numbers = traced.whole(diffuse=False), builder.numbers
        self._size = traced.texels.width, traced.texels.height
        looks = dict(builder.scene.materials) | dict.fromkeys(builder.measured, Material())
        self._names = [o.name for o in builder.scene.objects]
        self._shares = DiffuseShares([looks[o.material] for o in builder.scene.objects])
        self._textured = any(t.diffuse for t in builder.scene.textures.values())
        self._sun = None if traced.sun is None else SunRays(traced.sun, self._whole)
        self._sun_y = 1.0 if traced.sun is None else float(mi.luminance(mi.Color3f(*traced.sun.record.irradiance))[0])

    def look(
        self, centre: Floats, texels: int, passed: Set[str]
    ) -> tuple[NDArray[np.uint32], NDArray[np.float16], NDArray[np.float16]]:
        """What a probe at `centre` (3,) with faces of N texels a side sees, the objects `passed` left out.

        spots (6, N, N) as `baked.answering.stored` has them, tint (6, N, N, 3), sun (6, N, N).
        """
        directions = normalize(face_directions(texels)).reshape(-1, 3)
        own = mi.Bool(np.array([name in passed for name in self._names], bool))
        si = _behind(self._whole, rays_from(centre, directions), self._numbers, own, rays.has_holes(self._whole))
        met = si.is_valid()
        cosine = mi.Frame3f.cos_theta(si.wi)
        texel = light_map_texel(si, *self._size, met) * 2 + dr.select(cosine < 0, mi.UInt32(1), mi.UInt32(0))
        number = self._numbers.at(si, met)
        tint = mi.Color3f(1.0) * self._shares.seen(number, dr.abs(cosine), met)
        if self._textured:
            tint *= mi.Color3f(si.bsdf().eval_attribute_3(DIFFUSE_ATTRIBUTE, si, met))
        sun: Any = mi.Color3f(0.0) if self._sun is None else self._sun(si, met)
        spot, lit = dr.select(met, texel, NO_SPOT), mi.luminance(sun) * dr.select(cosine < 0, -1.0, 1.0)
        lit = dr.select(met, lit / self._sun_y, 0.0) + dr.zeros(mi.Float, len(directions))
        dr.eval(spot, lit)
        shape = 6, texels, texels
        colours = np.where(np.array(met)[:, None], array_of(tint), 0.0).reshape(*shape, 3)
        sun_share = np.array(lit).reshape(shape).astype(np.float16)
        return np.array(spot).reshape(shape), colours.astype(np.float16), sun_share


@dr.syntax
def _behind(scene, ray, numbers, own, holes):  # type: ignore[no-untyped-def]
    """First interactions with objects that are not `own`."""
    ray = mi.Ray3f(ray)
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(ray.o))
    again, count = dr.full(mi.Bool, True, dr.width(ray.o)), dr.zeros(mi.UInt32, dr.width(ray.o))
    while again:
        si = rays.intersect(scene, ray, again, holes)
        number = numbers.at(si, again & si.is_valid())
        mine = dr.gather(mi.Bool, own, number, again & si.is_valid())
        ray = rays.leaving(scene, si.p, si.n, ray.d)
        count += 1
        again &= si.is_valid() & mine & (count < MOST_OWN)
    return si
