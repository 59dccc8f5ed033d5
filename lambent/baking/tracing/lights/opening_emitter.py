"""Openings of luminaires as Mitsuba emitters: the far field of the photometry, spread over a convex surface.

Each point of the surface has the radiance L(w) = I(w) / A(w) towards unit w that leave it, where A is the area of the
surface's silhouette seen from w. Far away this is the photometry's intensity I; nearby, light comes from all of the
opening.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.engine import once_per_variant
from lambent.baking.tracing.lights.candela import Candela
from lambent.scenes.photometry.luminous_surfaces import THIN_M, is_flat
from lambent.scenes.scene import IesLight

LEAST_SHARE = 0.01  # of the largest silhouette: a flat opening that shines along itself would be infinitely bright


def opening_emitter(light: IesLight) -> Any:
    """mi.Emitter for the mesh of a luminaire's opening (`luminous_surfaces.surface_of`)."""
    return _emitter_class()(mi.Properties(), light)


@once_per_variant
def _emitter_class() -> Any:
    class OpeningEmitter(mi.Emitter):  # type: ignore[misc]
        def __init__(self, props: Any, light: IesLight) -> None:
            mi.Emitter.__init__(self, props)
            self.m_flags = int(mi.EmitterFlags.Surface)
            self._light, self._opening = light, light.photometry.opening
            x, y, z = self._opening.size_m if is_flat(light) else np.maximum(self._opening.size_m, THIN_M).tolist()
            self._faces = [dr.opaque(mi.Float, area) for area in (y * z, z * x, x * y)]
            self._axes = [mi.ScalarVector3f(*axis) for axis in light.axes.tolist()]
            self._scale = mi.ScalarColor3f(*light.scale)
            self._candela = Candela([light.photometry])

        def _silhouette_m2(self, w: Any) -> Any:
            """Area seen from unit directions in luminaire axes: `Opening.projected_m2`."""
            faces = [dr.abs(part) * area for part, area in zip(w, self._faces, strict=True)]
            if self._opening.shape == "ellipsoid":
                return dr.pi / 4 * dr.sqrt(sum(part * part for part in faces))
            if self._opening.shape == "box":
                return sum(faces)
            along = faces.pop(self._opening.axis)
            return dr.pi / 4 * along + dr.sqrt(faces[0] * faces[0] + faces[1] * faces[1])

        def _radiance(self, w: Any, active: Any) -> Any:
            """W/(sr m^2) along unit world directions that leave the surface."""
            x, y, z = (dr.dot(w, axis) for axis in self._axes)
            most = self._silhouette_m2([mi.Float(1.0)] * 3)
            area = dr.maximum(self._silhouette_m2([x, y, z]), LEAST_SHARE * most)
            return mi.Color3f(self._scale) * self._candela.towards(mi.UInt32(0), x, y, z, active) / area

        def eval(self, si: Any, active: Any = True) -> Any:
            seen = active & (mi.Frame3f.cos_theta(si.wi) > 0)
            return dr.select(seen, self._radiance(si.to_world(si.wi), seen), 0.0)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> tuple[Any, Any]:
            ds = self.get_shape().sample_direction(it, sample, active)
            active &= (dr.dot(ds.d, ds.n) < 0) & (ds.pdf > 0)
            ds.emitter = mi.EmitterPtr(self)
            return ds, dr.select(active, self._radiance(-ds.d, active) / ds.pdf, 0.0)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return dr.select(dr.dot(ds.d, ds.n) < 0, self.get_shape().pdf_direction(it, ds, active), 0.0)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            active &= dr.dot(ds.d, ds.n) < 0
            return dr.select(active, self._radiance(-ds.d, active), 0.0)

        def sample_ray(self, time: Any, wavelength: Any, place: Any, direction: Any, active: Any = True) -> Any:
            ps = self.get_shape().sample_position(time, place, active)
            local = mi.warp.square_to_cosine_hemisphere(direction)
            w = mi.Frame3f(ps.n).to_world(local)
            si = dr.zeros(mi.SurfaceInteraction3f, dr.width(w))
            si.p, si.n = ps.p, ps.n
            weight = dr.select(ps.pdf > 0, dr.pi / ps.pdf, 0.0)
            return si.spawn_ray(w), dr.select(active, self._radiance(w, active) * weight, 0.0)

        def bbox(self) -> Any:
            return self.get_shape().bbox()

        def to_string(self) -> str:
            return f"OpeningEmitter[{self._opening}]"

    return OpeningEmitter
