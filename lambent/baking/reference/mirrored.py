"""Traced reflections of one object in a view: the reference for its light field.

The object itself shows its diffuse light alone, as in a light field of one level: maps and reference are of the same
scene and differ only in their look-up.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.light_fields.acquisition import Surroundings, covered_distances, inverse_distances, radiance_maps
from lambent.baking.light_fields.surroundings import Maps, around
from lambent.baking.running.tiles import slices
from lambent.baking.tracing import path_tracer, rays
from lambent.baking.tracing.rays import array_of, rays_from
from lambent.baking.tracing.scene_builder import light_map_uv
from lambent.baking.tracing.traced_scene import TracedScene
from lambent.core.arrays import Floats, Indices
from lambent.core.geometry.directions import reflect
from lambent.core.light.colour import HALF_MAX, halves
from lambent.core.views.camera import Camera, rays_through

PATHS_AT_ONCE = 1 << 21
DEPTH = 6  # glossy surfaces in a row
Halves = NDArray[np.float16]


@dataclass(frozen=True)
class Shown:
    """Pixels (k,) that show an object, by number, and its surface there, float64.

    x, n, flat, wo (k, 3): position, shading normal, triangle normal, direction to the viewer. uv2 (k, 2) is the light
    map's. Pixels whose mirror direction points into the object's triangles are left out.
    """

    pixel: Indices
    x: Floats
    n: Floats
    flat: Floats
    wo: Floats
    uv2: Floats

    @property
    def w(self) -> Floats:
        """The mirror directions (k, 3)."""
        return reflect(self.wo, self.n)


class MirrorTracer:
    """Traces reflections in an object of a baked scene, and maps of the same surroundings, without the sun's disc."""

    def __init__(self, traced: TracedScene, maps: Maps, name: str) -> None:
        self._builder, self._scene = traced.builder(diffuse=False), traced.whole(diffuse=False)
        self._name, self._mesh = name, traced.scene.object(name).mesh
        self._cache = traced.cache(*maps)
        self._around = around(traced, maps, DEPTH, (name,))

    def shown(self, camera: Camera, width: int, height: int, samples: int, seed: int = 0) -> Shown:
        """Surface points of the object at `samples` random places per pixel; a pixel appears once per hit."""
        rng, eye = np.random.default_rng(seed), np.asarray(camera.position, float)
        row, column = np.divmod(np.arange(width * height), width)
        found = []
        for _ in range(samples):
            x, y = rng.random((2, width * height))
            found.append(self._seen(eye, rays_through(camera, column + x, row + y, width, height)))
        return Shown(*(np.concatenate([getattr(part, f.name) for part in found]) for f in fields(Shown)))

    def mirrored(self, shown: Shown, seed: int = 0) -> Floats:
        """Radiance (k, 3) from the mirror directions, by one path each."""
        return self._along(shown.x, shown.flat, shown.w, seed)

    def surface(self, shown: Shown) -> Floats:
        """Radiance (k, 3) of the object itself towards the viewer, from its light map."""
        near = shown.x + 10 * rays.APPROACH * shown.wo
        return self._along(near, shown.wo, -shown.wo, 0)

    def distance_m(self, shown: Shown) -> Floats:
        """Length (k,) of the mirrored rays, infinite without a hit."""
        return rays.distances(self._scene, rays.leaving(self._scene, shown.x, shown.flat, shown.w))

    def maps(self, points: Floats, texels: int, strata: int, seed: int = 0) -> tuple[Halves, Halves, NDArray[np.uint8]]:
        """Radiance (P, E, E, 3), inverse distance and cover (P, E, E) from points (P, 3), as in light fields."""
        return _maps(self._around, points, texels, strata, seed)

    def map_from_middle(self, texels: int, strata: int, seed: int = 0) -> tuple[Floats, Halves, Halves]:
        """The object's centre (1, 3), and one map from there without the object, for reflection mapping."""
        middle = np.mean(self._mesh.bounds, axis=0, keepdims=True).astype(float)
        scene = self._builder.build(leave_out=(self._name,))
        without = Surroundings(scene, self._cache, DEPTH, self._around.sun)
        light, _ = radiance_maps(without, middle, texels, strata, seed)
        return middle, halves(light, 1.0), inverse_distances(without.scene, middle, texels)

    def _seen(self, eye: Floats, w: Floats) -> Shown:
        """The rays (r, 3) from the eye that hit the object."""
        si = self._scene.ray_intersect(rays_from(eye, w))
        number = list(self._builder.meshes).index(self._name)
        mine = si.is_valid() & (self._builder.numbers.at(si, si.is_valid()) == number)
        uv2 = light_map_uv(si, mine)
        dr.eval(si, mine, uv2)
        n, flat = (array_of(normal).astype(float) for normal in (si.sh_frame.n, si.n))
        use = np.array(mine) & (np.sum(w * flat, axis=-1) < 0) & (np.sum(reflect(-w, n) * flat, axis=-1) > 0)
        uv = np.stack([np.array(uv2.x), np.array(uv2.y)], axis=-1).astype(float)
        return Shown(np.flatnonzero(use), array_of(si.p).astype(float)[use], n[use], flat[use], -w[use], uv[use])

    def _along(self, x: Floats, flat: Floats, w: Floats, seed: int) -> Floats:
        """Radiance (k, 3) arriving at surface points along w, by one path each."""
        scene, sampler = self._around.scene, rays.independent(seed, len(w))
        ray = rays.leaving(scene, x, flat, w)
        start = path_tracer.camera_start(ray)
        value = path_tracer.radiance(scene, sampler, start, self._around.depth, self._around.cache)
        value = self._around.without_sun(value, ray, rays.intersect(scene, ray, mi.Bool(True), rays.has_holes(scene)))
        value = dr.select(dr.all(dr.isfinite(value)), value, 0.0)
        dr.eval(value)
        return array_of(value).astype(float)


def _maps(
    seen: Surroundings, points: Floats, texels: int, strata: int, seed: int
) -> tuple[Halves, Halves, NDArray[np.uint8]]:
    radiance = np.empty((len(points), texels, texels, 3), np.float16)
    for mine in slices(len(points), max(1, PATHS_AT_ONCE // (texels * strata) ** 2)):
        maps, _ = radiance_maps(seen, points[mine], texels, strata, seed + mine.start, covers=True)
        radiance[mine] = np.minimum(maps, HALF_MAX)
    return radiance, *covered_distances(seen.scene, points, texels)
