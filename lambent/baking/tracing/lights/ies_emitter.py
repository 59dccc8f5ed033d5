"""Luminaires of IES photometry as Mitsuba emitters: points with intensity linear between the file's angles."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.engine import once_per_variant
from lambent.baking.tracing.lights.candela import Candela
from lambent.scenes.scene import IesLight


def ies_emitter(light: IesLight) -> Any:
    """mi.Emitter of a luminaire."""
    return _emitter_class()(mi.Properties(), light)


@once_per_variant
def _emitter_class() -> Any:
    class IesEmitter(mi.Emitter):  # type: ignore[misc]
        def __init__(self, props: Any, light: IesLight) -> None:
            mi.Emitter.__init__(self, props)
            self.m_flags = int(mi.EmitterFlags.DeltaPosition)
            self._light = light
            self._position = mi.ScalarPoint3f(*light.position)
            self._axes = [mi.ScalarVector3f(*axis) for axis in light.axes.tolist()]
            self._scale = mi.ScalarColor3f(*light.scale)
            theta, phi = np.radians(light.photometry.vertical_deg), np.radians(light.photometry.horizontal_deg)
            candela = np.array(light.photometry.candela)
            self._candela = Candela([light.photometry])
            corners = candela[1:, 1:] + candela[1:, :-1] + candela[:-1, 1:] + candela[:-1, :-1]
            flux = corners * np.diff(phi)[:, None] * -np.diff(np.cos(theta))
            # A dark luminaire is drawn as any: its power is 0.
            self._cells = mi.DiscreteDistribution(
                mi.Float((flux if flux.any() else flux + 1).astype(np.float32).ravel())
            )

        def _intensity(self, w: Any, active: Any) -> Any:
            """W/sr along unit world directions."""
            x, y, z = (dr.dot(w, axis) for axis in self._axes)
            return mi.Color3f(self._scale) * self._candela.towards(mi.UInt32(0), x, y, z, active)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> tuple[Any, Any]:
            ds = dr.zeros(mi.DirectionSample3f)
            to = self._position - it.p
            ds.p, ds.dist = mi.Point3f(self._position), dr.norm(to)
            ds.d = to / ds.dist
            ds.n, ds.pdf, ds.delta, ds.time = -ds.d, mi.Float(1.0), mi.Bool(True), it.time
            ds.emitter = mi.EmitterPtr(self)
            return ds, self._intensity(-ds.d, active) / dr.square(ds.dist)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return mi.Float(0.0)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return self._intensity(-ds.d, active) / dr.square(ds.dist)

        def eval(self, si: Any, active: Any = True) -> Any:
            return mi.Color3f(0.0)

        def sample_ray(self, time: Any, wavelength: Any, place: Any, direction: Any, active: Any = True) -> Any:
            cell, over, share = self._cells.sample_reuse_pmf(direction.x, active)
            theta, phi_nodes = self._candela.theta, self._candela.phi
            columns = dr.width(theta) - 1
            i, j = cell // columns, cell % columns
            low, high = (dr.cos(dr.gather(mi.Float, theta, j + k, active)) for k in (0, 1))
            first, last = (dr.gather(mi.Float, phi_nodes, i + k, active) for k in (0, 1))
            cosine, phi = dr.lerp(low, high, over), dr.lerp(first, last, direction.y)
            sine = dr.safe_sqrt(1 - cosine * cosine)
            x, y, z = (mi.Vector3f(axis) for axis in self._axes)
            w = dr.normalize(sine * dr.cos(phi) * x + sine * dr.sin(phi) * y + cosine * z)
            ray = mi.Ray3f(mi.Point3f(self._position) + dr.zeros(mi.Point3f, dr.width(w)), w)
            weight = (last - first) * (low - high) / share
            return ray, dr.select(active, self._intensity(w, active) * weight, 0.0)

        def bbox(self) -> Any:
            return mi.ScalarBoundingBox3f(self._position)

        def to_string(self) -> str:
            return f"IesEmitter[{self._light.photometry.lumens:.0f} lm]"

    return IesEmitter
