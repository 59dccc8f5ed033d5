"""Diffuse light of the surfaces that the eye sees, gathered by one more bounce instead of read from the light map.

A picture then converges to the truth but for what the light map contributes one bounce later: its resolution, leaks and
seams are seen through a whole hemisphere (final gathering, Reichert 1992). Beside contacts, where single texels of the
map cover much of that hemisphere, another bounce is gathered.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.bsdfs.material_plugin import NORMAL_ATTRIBUTE
from lambent.baking.light.cache import LightMapCache
from lambent.baking.quality import MAX_DEPTH
from lambent.baking.tracing import path_tracer
from lambent.baking.tracing.traced_scene import TracedScene
from lambent.core.arrays import Floats
from lambent.core.geometry.triangles import triangle_areas

NEAR_TEXELS = 3.0  # a surface that a gathering path meets within this many of its own texels gathers once more


class Gathering:
    """Gathers in the scene without diffuse terms of `traced`, onto its light map `cache`, with a tally of one sum."""

    def __init__(self, traced: TracedScene, cache: LightMapCache, tally: path_tracer.Tally) -> None:
        self._scene, self.cache, self._tally = traced.whole(diffuse=False), cache, tally
        self._unseen = traced.unseen(diffuse=False)
        self._numbers = traced.builder(diffuse=False).numbers
        self._near_m = mi.Float((NEAR_TEXELS * texel_sizes(traced)).astype(np.float32))

    def radiance(self, si: Any, sampler: Any, active: Any) -> Any:
        """One sample of the diffuse radiance (mi.Color3f) of surfaces towards `si.wi`."""
        return self._gathered(si, sampler, active, self._near_contacts)

    def irradiance(self, points: path_tracer.Points, sampler: Any) -> Any:
        """One sample of the irradiance (mi.Color3f) at points, which need not lie on surfaces, W/m^2."""
        found = self._arriving(points, sampler, mi.Bool(True), self._near_contacts)
        return sum((light for light, _ in found), mi.Color3f(0.0))

    def _near_contacts(self, si: Any, active: Any) -> Any:
        near = active & (si.t < dr.gather(mi.Float, self._near_m, self._numbers.faces(si, active), active))
        again = self._gathered(si, Random.at(si.p), near, self.cache)
        return dr.select(near, again, self.cache(si, active & ~near))

    def _gathered(self, si: Any, sampler: Any, active: Any, cache: path_tracer.Cache) -> Any:
        reflected, transmitted, number = self.cache.colours(si, active)
        brightness = [dr.sum(colour) for colour in (reflected, transmitted)]  # dr.mean compiles for every width
        share = brightness[1] / dr.maximum(brightness[0] + brightness[1], 1e-9)
        active = active & (brightness[0] + brightness[1] > 0)
        across = sampler.next_1d(active) < share
        normal = mi.Vector3f(si.bsdf().eval_attribute_3(NORMAL_ATTRIBUTE, si, active))
        viewer = si.to_world(si.wi)
        cos_o = dr.dot(normal, viewer)
        turn = dr.select(across, -1.0, 1.0)
        points = path_tracer.Points(
            si.p, normal * dr.mulsign(turn, cos_o), mi.Vector3f(si.n) * dr.mulsign(turn, dr.dot(si.n, viewer))
        )
        found = mi.Color3f(0.0)
        for light, w in self._arriving(points, sampler, active, cache):
            cos_i = dr.dot(w, points.normal)
            found += light * dr.select(across, 1.0, self.cache.shares.between(number, cos_i, dr.abs(cos_o), active))
        weight = dr.select(across, dr.rcp(dr.maximum(share, 1e-6)), dr.rcp(dr.maximum(1 - share, 1e-6)))
        return dr.select(active, dr.select(across, transmitted, reflected) * weight * found, 0.0)

    def _arriving(
        self, points: path_tracer.Points, sampler: Any, active: Any, cache: path_tracer.Cache
    ) -> list[tuple[Any, Any]]:
        """Irradiances (mi.Color3f) that add up to one sample of all light at points, and their directions."""
        found = path_tracer.arriving(
            self._scene, sampler, points, sampler.next_2d(active), sampler.next_2d(active), MAX_DEPTH, cache,
            self._tally, self._unseen, active,
        )  # fmt: skip
        return found + self.cache.sun_on(points, active)


@dataclass
class Random:
    """A sampler for each thread (mi.PCG32), independent of that of an enclosing loop."""

    state: Any

    @classmethod
    def at(cls, p: Any) -> Random:
        """Started by the bits of points p (mi.Point3f)."""
        bits = [dr.reinterpret_array(mi.UInt32, x) for x in (p.x, p.y, p.z)]
        start = mi.sample_tea_64(bits[0] ^ bits[1], bits[2])
        return cls(mi.PCG32(dr.width(p), start, mi.sample_tea_64(bits[2], bits[0])))

    def next_1d(self, active: Any = True) -> Any:
        return self.state.next_float32(active)

    def next_2d(self, active: Any = True) -> Any:
        return mi.Point2f(self.state.next_float32(active), self.state.next_float32(active))


def texel_sizes(traced: TracedScene) -> Floats:
    """(F,) sizes in metres of the light map's texels on each triangle; 0 on triangles without texels."""
    merged, atlas = traced.merged, traced.atlas
    corners, uv2 = merged["positions"][merged["faces"]], merged["uv2"][merged["faces"]] * (atlas.width, atlas.height)
    a, b = uv2[:, 1] - uv2[:, 0], uv2[:, 2] - uv2[:, 0]
    texels = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    return np.asarray(
        np.sqrt(np.divide(triangle_areas(corners), texels, out=np.zeros(len(texels)), where=texels > 1e-9))
    )
