"""The sun that is removed from the light map: the light to leave out of paths' starts, and its light by shadow rays."""

from __future__ import annotations

from typing import Any, Protocol

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.sky.sun import ALIGNED, FoundSun
from lambent.baking.tracing import rays
from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.directions import basis
from lambent.core.light.light_mix import WHITE
from lambent.core.plain import Triple


class FirstEmitters(Protocol):
    """Emitters of a mi.Scene without the sun, and their density for light hit in the whole scene (`FirstLight`)."""

    scene: Any

    def pdf(self, si: Any, ds: Any, first: Any, active: Any) -> Any: ...


class Sun:
    """A sun on the device, valid in all Mitsuba scenes built from its scene.

    `first` are the other emitters of one of these, sampled at the start of paths without the sun.
    """

    def __init__(self, found: FoundSun, first: FirstEmitters | None = None) -> None:
        self.record, self.first, self._picture = found.record, first, found.picture
        self.passes_panes = bool(found.record.panes)
        self.direction = mi.Vector3f(*found.record.direction)
        if found.picture is not None:
            pixels = mi.TensorXf(found.picture.pixels)
            self._texels = mi.Texture2f(pixels, wrap_mode=dr.WrapMode.Clamp)
            self._turn = [[float(x) for x in axis] for axis in found.picture.turn.T]

    @property
    def is_in_sky(self) -> bool:
        """Whether it is part of the environment's picture."""
        return self._picture is not None

    def radiance(self, w: Any) -> Any:
        """The sun's part of the environment's radiance (mi.Color3f) along unit directions w (mi.Vector3f)."""
        if self._picture is None:
            return mi.Color3f(0.0)
        (height, width), (top, left) = self._picture.size, self._picture.corner
        x, y, z = (axis[0] * w.x + axis[1] * w.y + axis[2] * w.z for axis in self._turn)
        around = dr.atan2(x, -z) / (2 * dr.pi)
        column = (around - dr.floor(around)) * width - 0.5 - left
        column -= dr.floor(column / width) * width
        row = dr.safe_acos(y) * ((height - 1) / dr.pi) - top
        h, w_ = self._picture.pixels.shape[:2]
        inside = (row > 0) & (row < h - 1) & (column > 0) & (column < w_ - 1)
        place = mi.Point2f((column + 0.5) / w_, (row + 0.5) / h)
        return dr.select(inside, mi.Color3f(self._texels.eval(place, inside)), 0.0)

    def left_out(self, ds: Any, value: Any) -> Any:
        """Light over density (mi.Color3f) of emitter samples ds (mi.DirectionSample3f), without the sun's part."""
        if self._picture is not None:
            return value - dr.select(ds.emitter.is_environment(), self.radiance(ds.d) / ds.pdf, 0.0)
        directional = mi.has_flag(ds.emitter.flags(), mi.EmitterFlags.DeltaDirection)
        return dr.select(directional & (dr.dot(ds.d, self.direction) > 1 - ALIGNED), 0.0, value)

    def goes_on(self, si: Any, wi: Any, active: Any) -> Any:
        """Whether light along wi (mi.Vector3f, local) reaches `si.wi` straight through clear glass."""
        across = active & (wi.z * si.wi.z < 0)
        return across & (dr.max(rays.straight_on(si, across)) > 0) if self.passes_panes else mi.Bool(False)

    def sky_share(self, environment: Any, w: Any) -> Any:
        """Share (mi.Color3f) of the environment's radiance along unit directions w that is not the sun's."""
        if self._picture is None:
            return mi.Color3f(1.0)
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(w))
        si.wi = -w
        return dr.clip(1 - self.radiance(w) / dr.maximum(environment.eval(si), 1e-20), 0, 1)

    def is_light(self, emitter: Any, w: Any) -> Any:
        """Whether emitters (mi.EmitterPtr) seen along w (mi.Vector3f) are the sun."""
        directional = mi.has_flag(emitter.flags(), mi.EmitterFlags.DeltaDirection)
        return directional & (self._picture is None) & (dr.dot(w, self.direction) > 1 - ALIGNED)


class NoSun:
    """In place of a `Sun` where only lamps are left out: all light of other emitters counts."""

    passes_panes = False

    def __init__(self, first: FirstEmitters) -> None:
        self.first = first

    def radiance(self, w: Any) -> Any:
        return mi.Color3f(0.0)

    def goes_on(self, si: Any, wi: Any, active: Any) -> Any:
        return mi.Bool(False)


Unseen = Sun | NoSun  # what samples at points of the light map leave out


class SunRays:
    """Irradiance of a sun on surfaces of a Mitsuba scene, by shadow rays to random points of its disc.

    `factor` multiplies it by channel.
    """

    def __init__(self, sun: Sun, scene: Any, factor: Triple = WHITE) -> None:
        self._sun, self._scene = sun, scene
        self._blocked_by_all = not (sun.passes_panes or rays.has_holes(scene))
        across, up = basis(np.array(sun.record.direction))
        self._across, self._up = mi.Vector3f(*map(float, across)), mi.Vector3f(*map(float, up))
        self._tangent = float(np.tan(sun.record.radius_rad))
        light = (one * share for one, share in zip(sun.record.irradiance, factor, strict=True))
        self._irradiance = mi.Color3f(*(dr.opaque(mi.Float, float(one)) for one in light))

    @property
    def direction(self) -> Floats:
        """Towards the middle of the sun, (3,) float64."""
        return np.array(self._sun.record.direction, float)

    def __call__(self, si: Any, active: Any) -> Any:
        """Irradiance (mi.Color3f), including the cosine of the shading normal: negative on the back.

        Each place of a surface has its own random direction.
        """
        bits = [dr.reinterpret_array(mi.UInt32, x) for x in (si.p.x, si.p.y, si.p.z)]
        u = mi.Point2f(mi.sample_tea_float32(bits[0] ^ bits[1], bits[2]), mi.sample_tea_float32(bits[2], bits[0]))
        cosine = dr.dot(si.sh_frame.n, self._sun.direction)
        lit = active & (cosine != 0)
        ray = rays.leaving(self._scene, si.p, si.n, self._direction(u))
        if self._blocked_by_all:
            return dr.select(lit & ~self._scene.ray_test(ray, lit), self._irradiance * cosine, 0.0)
        return self._irradiance * cosine * rays.passed(self._scene, ray, lit)

    def on(self, points: Any, normals: Any, flat: Any, active: Any) -> Any:
        """Irradiance (mi.Color3f) on the front of points of surfaces, by shading and triangle normals."""
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(points))
        si.p, si.n, si.sh_frame = mi.Point3f(points), mi.Normal3f(flat), mi.Frame3f(mi.Normal3f(normals))
        return dr.maximum(self(si, active), 0.0)

    def arrive(self, points: Floats, normals: Floats, seed: int) -> Flags:
        """Whether one ray each from points (n, 3) of flat surfaces (normals (n, 3)) reaches the sun, (n,)."""
        w = self._direction(rays.independent(seed, len(points)).next_2d())
        ray, active = rays.leaving(self._scene, points, normals, w), mi.Bool(True)
        if self._blocked_by_all:
            return ~np.array(self._scene.ray_test(ray, active))
        return np.array(dr.max(rays.passed(self._scene, ray, active))) > 0

    def _direction(self, u: Any) -> Any:
        """Unit directions to places of the disc, by u (mi.Point2f) in the unit square."""
        on_disc = mi.warp.square_to_uniform_disk_concentric(u) * self._tangent
        return dr.normalize(self._sun.direction + self._across * on_disc.x + self._up * on_disc.y)
