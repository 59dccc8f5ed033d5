"""The environment as a Mitsuba emitter that is sampled by where it is seen (`sky_guide`).

It stands in the place of the environment that it holds: whoever samples emitters of a scene, or asks for the density
of a direction, has the guide without knowing.
"""

from __future__ import annotations

import functools
from typing import Any

from lambent.bake.engine import engine
from lambent.bake.sky_guide import SkyGuide


def guided_sky(sky: Any, guide: SkyGuide, bounds: Any) -> Any:
    """mi.Emitter that emits what `sky` emits, for a scene within `bounds` (mi.BoundingBox3f)."""
    import mitsuba as mi

    props = mi.Properties()
    props["sky"] = sky
    return _emitter_class(engine().variant)(props, guide, bounds)


@functools.cache
def _emitter_class(variant: str) -> Any:
    """The class must be made after the variant is set: it derives from that variant's mi.Emitter."""
    import drjit as dr
    import mitsuba as mi

    class GuidedSky(mi.Emitter):  # type: ignore[misc, name-defined]
        def __init__(self, props: Any, guide: SkyGuide, bounds: Any) -> None:
            mi.Emitter.__init__(self, props)
            self.sky, self.guide = props["sky"], guide
            self.m_flags = self.sky.flags()
            sphere = bounds.bounding_sphere()
            self._centre, self._radius = mi.Point3f(sphere.center), mi.Float(sphere.radius)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> tuple[Any, Any]:
            table = self.guide.table_at(it.p, it.n, active)
            w = self.guide.sample(table, sample, active)
            reach = 2 * dr.maximum(self._radius, dr.norm(it.p - self._centre))
            ds = dr.zeros(mi.DirectionSample3f)
            ds.p, ds.d, ds.n, ds.dist = dr.fma(w, reach, it.p), w, -w, reach
            ds.time, ds.delta, ds.emitter = it.time, mi.Bool(False), mi.EmitterPtr(self)
            ds.pdf = self.guide.pdf(table, w, active)
            return ds, dr.select(active & (ds.pdf > 0), self._arriving(it, w, active) / ds.pdf, 0.0)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return self.guide.pdf(self.guide.table_at(it.p, it.n, active), ds.d, active)

        def _arriving(self, it: Any, w: Any, active: Any) -> Any:
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.wi, si.wavelengths = -w, it.wavelengths
            return self.sky.eval(si, active)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return self._arriving(it, ds.d, active)

        def eval(self, si: Any, active: Any = True) -> Any:
            return self.sky.eval(si, active)

        def sample_ray(self, *arguments: Any) -> Any:
            return self.sky.sample_ray(*arguments)

        def bbox(self) -> Any:
            return mi.ScalarBoundingBox3f()

        def to_string(self) -> str:
            return f"GuidedSky[{len(self.guide.shares)} tables]"

    return GuidedSky
