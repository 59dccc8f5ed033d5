"""Probe look-ups on the device: `baked.probes.lookups` in Dr.Jit, for many rays at once.

Sizes and plane counts are passed as data or padded, so that all probes share their kernels.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baked.probes.lookups import NEARNESS_MIN, PLANE_ACTIVE_M, SECANTS, STEPS, TINY, inverse_depth
from lambent.core.arrays import Floats
from lambent.core.light.colour import luminance

PADDED = 6  # planes are padded to multiples of this


class DeviceProbe:
    """Luminance that rays find in a probe of radiance (6, N, N, 3), by planes (P, 4) about its centre or by distance.

    Parameters
    ----------
    distance : (6, N, N), optional
        If given, rays are looked up by it instead of by the planes.
    """

    def __init__(self, centre: Floats, radiance: Floats, planes: Floats, distance: Floats | None) -> None:
        self._centre = mi.Point3f(*(dr.opaque(mi.Float, float(x)) for x in centre))
        self._light = _Cube(luminance(radiance.astype(float)))
        self._inverse = None if distance is None else _Cube(inverse_depth(distance.astype(float))[..., 0])
        padded = np.zeros((max(1, -(-len(planes) // PADDED)) * PADDED, 4), np.float32)
        padded[: len(planes)] = planes
        self._planes, self._count = mi.Float(padded.ravel()), len(padded)

    def luminance(self, p: Any, w: Any) -> Any:
        """mi.Float along unit w (mi.Vector3f) from points p (mi.Point3f) of the scene."""
        x = mi.Vector3f(p - self._centre)
        return self._light(self._by_planes(x, w) if self._inverse is None else self._by_distance(x, w, self._inverse))

    def _by_planes(self, x: Any, w: Any) -> Any:
        nearness = mi.Float(0.0)
        for i in range(self._count):
            n = mi.Vector3f(*(dr.gather(mi.Float, self._planes, 4 * i + k) for k in range(3)))
            height = dr.dot(x, n) + dr.gather(mi.Float, self._planes, 4 * i + 3)
            nearness = dr.maximum(nearness, dr.select(height > PLANE_ACTIVE_M, -dr.dot(w, n) / height, 0.0))
        return dr.select(nearness > NEARNESS_MIN, x + w / dr.maximum(nearness, NEARNESS_MIN), w)

    @staticmethod
    def _by_distance(x: Any, w: Any, inverse: _Cube) -> Any:
        reach = dr.norm(x)
        start = x / dr.maximum(reach, TINY)

        def behind(s: Any) -> Any:
            q = (1 - s) * start + s * w
            size = dr.max(dr.abs(q))
            return reach * size * inverse(dr.select(size > 0, q, w)) - (1 - s)

        near = far = mi.Float(0.0)
        f_near = f_far = behind(far)
        met, s = mi.Bool(False), mi.Float(0.0)
        for i in range(STEPS):
            near, f_near = dr.select(met, near, far), dr.select(met, f_near, f_far)
            far = dr.select(met, far, (i + 1) / STEPS)
            f_far = dr.select(met, f_far, behind(far))
            met |= (f_near < 0) & (f_far >= 0)
        for low, high in SECANTS:
            s = near + (far - near) * dr.clip(f_near / dr.minimum(f_near - f_far, -TINY), low, high)
            f = behind(s)
            near, f_near = dr.select(f < 0, s, near), dr.select(f < 0, f, f_near)
            far, f_far = dr.select(f < 0, far, s), dr.select(f < 0, f_far, f)
        return dr.select(met, (1 - s) * start + s * w, w)


class _Cube:
    """A scalar cube map (6, N, N), bilinear within each face like `core.geometry.cubemap.sample`."""

    def __init__(self, values: Floats) -> None:
        self._values = mi.Float(np.asarray(values, np.float32).ravel())
        self._n = dr.opaque(mi.UInt32, values.shape[1])

    def __call__(self, w: Any) -> Any:
        a = dr.abs(w)
        along_x, along_y = (a.x >= a.y) & (a.x >= a.z), a.y >= a.z
        major = dr.select(along_x, w.x, dr.select(along_y, w.y, w.z))
        negative = major < 0
        face = dr.select(along_x, mi.UInt32(0), dr.select(along_y, 2, 4)) + dr.select(negative, mi.UInt32(1), 0)
        s = dr.select(along_x, dr.select(negative, w.z, -w.z), dr.select(along_y, w.x, dr.select(negative, -w.x, w.x)))
        t = dr.select(along_x | ~along_y, -w.y, dr.select(negative, -w.z, w.z))
        n, scale = mi.Float(self._n), dr.rcp(dr.maximum(dr.abs(major), 1e-20))
        column, row = (dr.clip((v * scale + 1) / 2 * n - 0.5, 0, n - 1) for v in (s, t))
        c0, r0 = mi.UInt32(column), mi.UInt32(row)
        c1, r1 = (dr.minimum(v + 1, self._n - 1) for v in (c0, r0))
        fc, fr = column - mi.Float(c0), row - mi.Float(r0)
        at = [dr.gather(mi.Float, self._values, (face * self._n + r) * self._n + c) for r in (r0, r1) for c in (c0, c1)]
        return (at[0] * (1 - fc) + at[1] * fc) * (1 - fr) + (at[2] * (1 - fc) + at[3] * fc) * fr
