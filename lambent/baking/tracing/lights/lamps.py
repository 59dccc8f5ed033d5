"""Lamps: their direct light by shadow rays, which a light map adds to the light that it samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.tracing import rays
from lambent.baking.tracing.lights.candela import Candela
from lambent.baking.tracing.lights.emitters import number_of
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.arrays import Floats
from lambent.store.lamp_discs import half_axes_m

NEAREST = 1 / 16  # share of an opening that one of its points stands for
DARK = 1e-9  # weight of points without light, where no other is
ROW = 17  # numbers of an opening: position, axes, scale, half axes


class LampRays:
    """Irradiance of lamps on surfaces of a mi.Scene, by shadow rays.

    Parameters
    ----------
    builder : SceneBuilder
        Of the scene.
    bare : mi.Scene
        The scene without the openings of luminaires, which cast no shadows.
    numbers : list of int
        The lamps, among the scene's lights.
    factors : (n, 3), optional
        Factors on their light, by lamp and channel; 1 by default.
    """

    def __init__(self, builder: SceneBuilder, bare: Any, numbers: Sequence[int], factors: Floats | None = None) -> None:
        self._scene, self._holes, self.count = bare, rays.has_holes(bare), len(numbers)
        self._emitters = mi.UInt32(np.array([number_of(builder.lights[number]) for number in numbers], np.uint32))
        factors = np.ones((self.count, 3)) if factors is None else factors
        self._factors = mi.Color3f(*(mi.Float(channel.astype(np.float32)) for channel in np.asarray(factors).T))
        names, lights = builder.scene.openings, builder.scene.lights
        self._sized = {k: lights[number] for k, number in enumerate(numbers) if number in names}
        self.openings = Openings(self.count, self._sized) if self._sized else None

    def is_sized(self, lamp: int) -> bool:
        """Whether a lamp has an opening."""
        return lamp in self._sized

    def of(self, lamp: Any, si: Any, u: Any, active: Any) -> Any:
        """Irradiance (mi.Color3f) of lamp number `lamp` (mi.UInt32) as renderers draw it.

        It has the cosine of the shading normal: it is negative where light comes from behind. A luminaire with an
        opening has the intensity that its photometry has at the centre, and is visible if the point `u` (mi.Point2f)
        of its opening is.
        """
        emitter = dr.reinterpret_array(mi.EmitterPtr, dr.gather(mi.UInt32, self._emitters, lamp, active))
        sized = mi.Bool(False) if self.openings is None else self.openings.has(lamp, active)
        ds, light = emitter.sample_direction(si, mi.Point2f(0.5), active & ~sized)
        light, target = light * dr.dot(ds.d, si.sh_frame.n), ds.p
        if self.openings is not None:
            light = dr.select(sized, self.openings.drawn(lamp, si, active & sized), light)
            target = dr.select(sized, self.openings.point(lamp, u, active & sized), target)
        lit = active & (dr.max(dr.abs(light)) > 0)
        lit &= ~rays.hidden(self._scene, si.p, si.n, target, lit, self._holes)
        return dr.select(lit, light, 0.0) * dr.gather(mi.Color3f, self._factors, lamp, active)

    def seen(self, lamp: Any, si: Any, u: Any, active: Any) -> tuple[Any, Any]:
        """A sample of the visible share of an opening: the weight (mi.Float) of a point of it, 0 if hidden, and as is.

        Points weigh as much as the luminance that they would have at `si` with the photometry's intensity.
        """
        assert self.openings is not None, "the lamp has an opening"
        point = self.openings.point(lamp, u, active)
        weight = mi.luminance(dr.maximum(self.openings.light(lamp, si, point, NEAREST, active), 0.0)) + DARK
        return dr.select(rays.hidden(self._scene, si.p, si.n, point, active, self._holes), 0.0, weight), weight

    def unshadowed(self, lamp: Any, si: Any, u: Any, active: Any) -> tuple[Any, Any]:
        """Irradiances (mi.Color3f) of a lamp with an opening as if nothing were in the way, at least 0.

        One is as drawn, the other one sample of the light of all the opening.
        """
        assert self.openings is not None, "the lamp has an opening"
        emitter = dr.reinterpret_array(mi.EmitterPtr, dr.gather(mi.UInt32, self._emitters, lamp, active))
        ds, light = emitter.sample_direction(si, u, active)
        whole = dr.select(ds.pdf > 0, light * dr.dot(ds.d, si.sh_frame.n), 0.0)
        return dr.maximum(self.openings.drawn(lamp, si, active), 0.0), dr.maximum(whole, 0.0)

    def __call__(self, si: Any, active: Any) -> tuple[Any, Any]:
        """Irradiance (mi.Color3f) of all lamps as drawn, on the side of the shading normal, and on the other.

        Each place of a surface sees its own random points of openings.
        """
        both: tuple[Any, Any] = _sums(self, self.count, si, mi.Bool(active))
        return both


class Openings:
    """The lamps with an opening of `count` lamps, IesLights by place."""

    def __init__(self, count: int, sized: Mapping[int, Any]) -> None:
        which, rows = np.full(count, len(sized), np.uint32), np.zeros((count, ROW), np.float32)
        for k, (place, light) in enumerate(sized.items()):
            half_m = half_axes_m(light)
            which[place] = k
            rows[place] = [*light.position, *light.axes.ravel(), *light.scale, *half_m]
        self._count, self._which, self._rows = len(sized), mi.UInt32(which), mi.Float(rows.ravel())
        self._candela = Candela([light.photometry for light in sized.values()])

    def has(self, lamp: Any, active: Any) -> Any:
        """Whether a lamp (mi.UInt32) has an opening."""
        return dr.gather(mi.UInt32, self._which, lamp, active) < self._count

    def drawn(self, lamp: Any, si: Any, active: Any) -> Any:
        """Irradiance (mi.Color3f) without shadows, of the intensity at the centre.

        The opening counts as an ellipse of half axes a, b across its lamp's axis. On its axis at a distance r, a
        Lambertian disc of radius a has E = I/(r^2 + a^2).
        """
        return self.light(lamp, si, mi.Point3f(*self._row(lamp, 0, 3, active)), 1.0, active)

    def point(self, lamp: Any, u: Any, active: Any) -> Any:
        """A point (mi.Point3f) of that ellipse by u (mi.Point2f) in the unit square."""
        across, down = (mi.Vector3f(*self._row(lamp, k, 3, active)) for k in (3, 6))
        (a, b), place = self._row(lamp, 15, 2, active), mi.warp.square_to_uniform_disk_concentric(u)
        return mi.Point3f(*self._row(lamp, 0, 3, active)) + across * (a * place.x) + down * (b * place.y)

    def light(self, lamp: Any, si: Any, p: Any, share: float, active: Any) -> Any:
        """Irradiance (mi.Color3f) without shadows, if all light leaves a `share` of the ellipse around a point."""
        axes = [mi.Vector3f(*self._row(lamp, k, 3, active)) for k in (3, 6, 9)]
        scale, (a, b) = mi.Color3f(*self._row(lamp, 12, 3, active)), self._row(lamp, 15, 2, active)
        to = p - si.p
        square = dr.squared_norm(to)
        d = to * dr.rsqrt(dr.maximum(square, 1e-12))
        x, y, z = (-dr.dot(d, axis) for axis in axes)
        candela = self._candela.towards(dr.gather(mi.UInt32, self._which, lamp, active), x, y, z, active)
        return scale * candela * dr.dot(d, si.sh_frame.n) / dr.maximum(square + share * a * b, 1e-12)

    def _row(self, lamp: Any, first: int, count: int, active: Any) -> list[Any]:
        return [dr.gather(mi.Float, self._rows, lamp * ROW + first + k, active) for k in range(count)]


@dr.syntax
def _sums(lamps, count, si, active):  # type: ignore[no-untyped-def]
    width = dr.width(si.p)
    front, back = dr.zeros(mi.Color3f, width), dr.zeros(mi.Color3f, width)
    lamp = dr.zeros(mi.UInt32, width)
    bits = dr.reinterpret_array(mi.UInt32, si.p.x) ^ dr.reinterpret_array(mi.UInt32, si.p.y)
    bits ^= dr.reinterpret_array(mi.UInt32, si.p.z) * 0x9E3779B9
    while lamp < dr.opaque(mi.UInt32, count):
        u = mi.Point2f(mi.sample_tea_float32(bits, 2 * lamp), mi.sample_tea_float32(bits, 2 * lamp + 1))
        light = lamps.of(lamp, si, u, active)
        front += dr.maximum(light, 0.0)
        back += dr.maximum(-light, 0.0)
        lamp += 1
    return front, back
