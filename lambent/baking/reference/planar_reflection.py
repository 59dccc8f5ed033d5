"""Reflections of a lobe on a horizontal plane, every ray cast at the triangles: the reference for planar reflectors.

Surfaces emit the light map's light and their emission equally in all directions; the background is a uniform sky.
"""

from __future__ import annotations

from collections.abc import Mapping

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.light.cache import LightMapCache
from lambent.baking.running.tiles import slices
from lambent.baking.tracing.array_ops import array_ops
from lambent.baking.tracing.rays import block_sums, vectors
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.arrays import Floats
from lambent.core.plain import Triple
from lambent.core.progress import Progress, silent
from lambent.materials.document import Lobe
from lambent.materials.lobes import ArrayOps, density_of_slopes, slope_radius, tint
from lambent.scenes.scene import Scene

RAYS_AT_ONCE = 1 << 21  # a few hundred MiB, with progress about every second
WIDE = 1e-3  # mx my of a lobe above which rays to lamps pay off


class ReflectionTracer:
    """Casts rays at a scene with light map coordinates `uv2` and irradiance (H, W, 3), without the object `plane`.

    The plane is y = 0, t = +x, n = +y, b = n x t = -z.
    """

    def __init__(self, scene: Scene, uv2: Mapping[str, Floats], irradiance: Floats, plane: str, sky: Triple) -> None:
        builder = SceneBuilder(scene, uv2)
        self._scene = builder.build(leave_out={plane})
        self._cache = LightMapCache(builder, irradiance, None)
        self._numbers = builder.numbers
        self._emission = mi.Color3f(np.array([o.emission for o in scene.objects], np.float32).T.copy())
        self._lamps = [_enclosing_ball(o.mesh.positions.astype(float)) for o in scene.objects if max(o.emission) > 0]
        self._sky, self._ops = mi.Color3f(*sky), array_ops()

    def distance(self, origin: Floats, directions: Floats) -> Floats:
        """Distance (k,) from a point (3,) along unit directions (k, 3), infinite without a hit."""
        start = mi.Point3f(*map(float, origin)) + dr.zeros(mi.Point3f, len(directions))
        rays = mi.Ray3f(start, mi.Vector3f(np.ascontiguousarray(directions.T, np.float32)))
        met = self._scene.ray_intersect(rays, mi.RayFlags.Minimal, True)
        return np.array(dr.select(met.is_valid(), met.t, np.inf))

    def reflected(self, lobe: Lobe, points: Floats, wo: Floats, spp: int, progress: Progress = silent) -> Floats:
        """Radiance (k, 3) that points (k, 3) of the plane reflect towards wo (k, 3), from `spp` rays each.

        For a wide lobe, as many rays go to every lamp: few of its own would find one.
        """
        light = np.zeros((len(points), 3))
        at_once = max(1, RAYS_AT_ONCE // spp)
        rng = np.random.default_rng(7)
        for mine in slices(len(points), at_once):
            light[mine] = self._reflected(lobe, points[mine], wo[mine], spp, rng)
            progress(mine.stop, len(points), "points traced")
        return light

    def _reflected(self, lobe: Lobe, points: Floats, wo: Floats, spp: int, rng: np.random.Generator) -> Floats:
        index = dr.arange(mi.UInt32, len(points) * spp)
        at, k = index // spp, index % spp
        starts = rng.integers(1 << 32, size=(2, len(points)), dtype=np.uint64)
        view = dr.gather(mi.Vector3f, vectors(mi.Vector3f, wo), at)
        origin = dr.gather(mi.Point3f, vectors(mi.Point3f, points), at)
        lamps = self._lamps if lobe.mx * lobe.my > WIDE else []
        cones = [_cone(origin, lamp) for lamp in lamps]
        h = _half_vectors(lobe, at, k, starts, self._ops)
        directions = [2 * dr.dot(view, h) * h - view, *(_within(cone, _uniform(at, k, starts)) for cone in cones)]
        light = mi.Color3f(0.0)
        for wi in directions:
            arrived, density = self._arrived(lobe, origin, view, wi)
            # the balance heuristic (Veach 1997) over the lobe's and every lamp's samples
            total = density + sum((_cone_density(cone, wi) for cone in cones), mi.Float(0.0))
            light += dr.select(total > 0, arrived * density / total, 0.0)
        return block_sums(light, spp) / spp

    def _arrived(
        self, lobe: Lobe, origin: mi.Point3f, view: mi.Vector3f, wi: mi.Vector3f
    ) -> tuple[mi.Color3f, mi.Float]:
        """Light along wi times f cos/p of the lobe's own sampling, and its density p, 1/sr."""
        h = dr.normalize(wi + view)
        cos_d = dr.dot(view, h)
        valid = (cos_d > 1e-4) & (wi.y > 1e-4)
        shown = mi.Color3f(*(tint(dr.clip(cos_d, 0, 1), lobe, c, self._ops) for c in range(3)))
        gain = shown * wi.y / ((wi.y * view.y) ** lobe.alpha * h.y)
        si = self._scene.ray_intersect(mi.Ray3f(origin, wi), mi.RayFlags.All, True, valid)
        hit = valid & si.is_valid()
        number = self._numbers.at(si, hit)
        seen = self._cache(si, hit) + dr.gather(mi.Color3f, self._emission, number, hit)
        r2 = (h.x / (h.y * lobe.mx)) ** 2 + (h.z / (h.y * lobe.my)) ** 2
        density = density_of_slopes(r2, lobe, self._ops) / (dr.pi * lobe.mx * lobe.my * h.y**3 * 4 * cos_d)
        return dr.select(valid, gain * dr.select(hit, seen, self._sky), 0.0), dr.select(valid, density, 0.0)


def _enclosing_ball(vertices: Floats) -> tuple[Floats, float]:
    centre = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    return centre, float(np.linalg.norm(vertices - centre, axis=1).max())


def _cone(origin: mi.Point3f, ball: tuple[Floats, float]) -> tuple[mi.Vector3f, mi.Float]:
    """Axis of the cone that contains a ball, and 1 minus the cosine of its half angle; the full sphere from inside."""
    to = mi.Point3f(*map(float, ball[0])) - origin
    sin2 = ball[1] ** 2 / dr.maximum(dr.squared_norm(to), 1e-12)
    return dr.normalize(to), dr.select(sin2 < 1, sin2 / (1 + dr.sqrt(dr.maximum(1 - sin2, 0))), 2)  # no cancellation


def _within(cone: tuple[mi.Vector3f, mi.Float], uv: tuple[mi.Float, mi.Float]) -> mi.Vector3f:
    depth = uv[0] * cone[1]
    ring = dr.sqrt(dr.maximum(depth * (2 - depth), 0))
    sin, cos = dr.sincos(2 * dr.pi * uv[1])
    return mi.Frame3f(cone[0]).to_world(mi.Vector3f(ring * cos, ring * sin, 1 - depth))


def _cone_density(cone: tuple[mi.Vector3f, mi.Float], w: mi.Vector3f) -> mi.Float:
    """Density of `_within`, 1/sr."""
    return dr.select(0.5 * dr.squared_norm(w - cone[0]) <= cone[1], dr.inv_two_pi / cone[1], 0.0)


def _half_vectors(lobe: Lobe, at: mi.UInt32, k: mi.UInt32, starts: NDArray[np.uint64], ops: ArrayOps) -> mi.Vector3f:
    """World half vectors of sample k at point `at`: an additive sequence (Roberts 2018) starting at `starts`."""
    u, v = _uniform(at, k, starts)
    r = slope_radius(u, lobe, ops)
    phi = 2 * dr.pi * v
    return dr.normalize(mi.Vector3f(r * lobe.mx * dr.cos(phi), 1.0, -r * lobe.my * dr.sin(phi)))


def _uniform(at: mi.UInt32, k: mi.UInt32, starts: NDArray[np.uint64]) -> tuple[mi.Float, mi.Float]:
    u, v = (
        (mi.Float((dr.gather(mi.UInt32, mi.UInt32(word.astype(np.uint32)), at) + k * step) >> 8) + 0.5) / 16777216.0
        for word, step in zip(starts, (3242174889, 2447445413), strict=True)
    )
    return u, v
