"""Luminaires of IES photometry as Mitsuba emitters: points, or openings with their far field spread over a surface.

The intensity I is linear between the file's angles. Each point of an opening, a convex surface, has the radiance
L(w) = I(w) / A(w) towards unit w that leave it, where A is the area of the surface's silhouette seen from w. Far away
this is the photometry's intensity; nearby, light comes from all of the opening.
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


class Intensity:
    """The intensity of a luminaire along unit world directions."""

    def __init__(self, light: IesLight) -> None:
        self.axes = [mi.ScalarVector3f(*axis) for axis in light.axes.tolist()]
        self.candela, self._scale = Candela([light.photometry]), mi.ScalarColor3f(*light.scale)

    def components(self, w: Any) -> list[Any]:
        """Of directions, along the luminaire's axes."""
        return [dr.dot(w, axis) for axis in self.axes]

    def along(self, w: Any, active: Any) -> Any:
        """mi.Color3f, W/sr."""
        x, y, z = self.components(w)
        return mi.Color3f(self._scale) * self.candela.towards(mi.UInt32(0), x, y, z, active)


def ies_emitter(light: IesLight) -> Any:
    """mi.Emitter of a luminaire."""
    return _point_class()(mi.Properties(), light)


@once_per_variant
def _point_class() -> Any:
    class IesEmitter(mi.Emitter):  # type: ignore[misc]
        def __init__(self, props: Any, light: IesLight) -> None:
            mi.Emitter.__init__(self, props)
            self.m_flags = int(mi.EmitterFlags.DeltaPosition)
            self._light, self._shape = light, Intensity(light)
            self._position = mi.ScalarPoint3f(*light.position)
            theta, phi = np.radians(light.photometry.vertical_deg), np.radians(light.photometry.horizontal_deg)
            candela = np.array(light.photometry.candela)
            corners = candela[1:, 1:] + candela[1:, :-1] + candela[:-1, 1:] + candela[:-1, :-1]
            flux = corners * np.diff(phi)[:, None] * -np.diff(np.cos(theta))
            # A dark luminaire is drawn as any: its power is 0.
            self._cells = mi.DiscreteDistribution(
                mi.Float((flux if flux.any() else flux + 1).astype(np.float32).ravel())
            )

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> tuple[Any, Any]:
            ds = dr.zeros(mi.DirectionSample3f)
            to = self._position - it.p
            ds.p, ds.dist = mi.Point3f(self._position), dr.norm(to)
            ds.d = to / ds.dist
            ds.n, ds.pdf, ds.delta, ds.time = -ds.d, mi.Float(1.0), mi.Bool(True), it.time
            ds.emitter = mi.EmitterPtr(self)
            return ds, self._shape.along(-ds.d, active) / dr.square(ds.dist)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return mi.Float(0.0)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return self._shape.along(-ds.d, active) / dr.square(ds.dist)

        def eval(self, si: Any, active: Any = True) -> Any:
            return mi.Color3f(0.0)

        def sample_ray(self, time: Any, wavelength: Any, place: Any, direction: Any, active: Any = True) -> Any:
            cell, over, share = self._cells.sample_reuse_pmf(direction.x, active)
            theta, phi_nodes = self._shape.candela.theta, self._shape.candela.phi
            columns = dr.width(theta) - 1
            i, j = cell // columns, cell % columns
            low, high = (dr.cos(dr.gather(mi.Float, theta, j + k, active)) for k in (0, 1))
            first, last = (dr.gather(mi.Float, phi_nodes, i + k, active) for k in (0, 1))
            cosine, phi = dr.lerp(low, high, over), dr.lerp(first, last, direction.y)
            sine = dr.safe_sqrt(1 - cosine * cosine)
            x, y, z = (mi.Vector3f(axis) for axis in self._shape.axes)
            w = dr.normalize(sine * dr.cos(phi) * x + sine * dr.sin(phi) * y + cosine * z)
            ray = mi.Ray3f(mi.Point3f(self._position) + dr.zeros(mi.Point3f, dr.width(w)), w)
            weight = (last - first) * (low - high) / share
            return ray, dr.select(active, self._shape.along(w, active) * weight, 0.0)

        def bbox(self) -> Any:
            return mi.ScalarBoundingBox3f(self._position)

        def to_string(self) -> str:
            return f"IesEmitter[{self._light.photometry.lumens:.0f} lm]"

    return IesEmitter


def opening_emitter(light: IesLight) -> Any:
    """mi.Emitter for the mesh of a luminaire's opening (`luminous_surfaces.surface_of`)."""
    return _opening_class()(mi.Properties(), light)


@once_per_variant
def _opening_class() -> Any:
    class OpeningEmitter(mi.Emitter):  # type: ignore[misc]
        def __init__(self, props: Any, light: IesLight) -> None:
            mi.Emitter.__init__(self, props)
            self.m_flags = int(mi.EmitterFlags.Surface)
            self._opening, self._shape = light.photometry.opening, Intensity(light)
            x, y, z = self._opening.size_m if is_flat(light) else np.maximum(self._opening.size_m, THIN_M).tolist()
            self._faces = [dr.opaque(mi.Float, area) for area in (y * z, z * x, x * y)]

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
            most = self._silhouette_m2([mi.Float(1.0)] * 3)
            return self._shape.along(w, active) / dr.maximum(
                self._silhouette_m2(self._shape.components(w)), LEAST_SHARE * most
            )

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
