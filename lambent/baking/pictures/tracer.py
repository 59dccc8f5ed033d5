"""Pictures of a scene by paths through their pixels, all the way or ending on baked light.

`Kind.path` traces paths whole. With a light map, `Kind.ended` takes the light of the first diffuse surface from it, and
`Kind.gathered` that of the next one (`gathering`). All kinds share cameras, sampling and everything but the cache.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from lambent.baking.bsdfs.material_plugin import DIFFUSE_ATTRIBUTE, NORMAL_ATTRIBUTE, SPECULAR_ATTRIBUTE
from lambent.baking.light.cache import LightMapCache
from lambent.baking.pictures.gathering import Gathering
from lambent.baking.quality import MAX_DEPTH
from lambent.baking.running.tiles import slices
from lambent.baking.tracing import path_tracer
from lambent.baking.tracing.rays import block_sums, has_holes, intersect, rays_from
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.baking.tracing.sobol import SobolSampler
from lambent.baking.tracing.traced_scene import TracedScene
from lambent.core.arrays import Floats
from lambent.core.light.light_mix import WHITE
from lambent.core.plain import triple
from lambent.core.progress import Progress
from lambent.core.views.camera import Camera, image_plane
from lambent.materials.document import Material
from lambent.materials.factored.albedo import term_albedo
from lambent.materials.factored.terms import Editable

RAYS_AT_ONCE = 1 << 21
Image = NDArray[np.float32]


class Kind(Enum):
    """Where paths end; see the module."""

    path = "path"
    ended = "ended"
    gathered = "gathered"


class Part(Enum):
    """Part of the light at the surface that the eye sees: diffuse and emitted, by lobes, or full, with the sky."""

    full = "full"
    diffuse = "diffuse"
    specular = "specular"


@dataclass(frozen=True, eq=False)
class LightMap:
    """Irradiance (H, W, 3) of front and back, W/m^2, in a mix of light groups: `factors` (n, 3), None as baked.

    A side without light is None. The direct light of `lamps` is left out: numbers of lights of the scene, and their
    groups.
    """

    front: Floats | None
    back: Floats | None = None
    factors: Floats | None = None
    lamps: tuple[tuple[int, int], ...] = ()


class Tracer:
    """Samples of pictures of one scene: of all kinds `of_baked` light, of whole paths alone `of_paths`."""

    def __init__(
        self, scene: Any, builder: SceneBuilder, tally: path_tracer.Tally, cache: LightMapCache | None = None,
        gather: Callable[[], Gathering] | None = None, max_depth: int = MAX_DEPTH,
    ) -> None:  # fmt: skip
        self._scene, self._tally, self._cache, self._max_depth = scene, tally, cache, max_depth
        self._gather, self._surfaces = gather, _SurfaceGuides(builder)

    @classmethod
    def of_baked(cls, traced: TracedScene, light: LightMap) -> Tracer:
        """Samples of a scene whose light map is `light`."""
        tally, of_sun = tally_of(traced, light.factors, diffuse=False), WHITE
        if light.factors is not None and (sun := traced.sorted_lights.sun) is not None:
            of_sun = triple(light.factors[sun])
        front = np.zeros((1, 1, 3), np.float32) if light.front is None else light.front
        lamps = traced.lamp_rays(light.lamps, light.factors) if light.lamps else None
        cache = traced.cache(front, light.back, of_sun, lamps)
        scene, builder = traced.whole(diffuse=False), traced.builder(diffuse=False)
        return cls(scene, builder, tally, cache, lambda: Gathering(traced, cache, tally))

    @classmethod
    def of_paths(cls, traced: TracedScene, factors: Floats | None = None) -> Tracer:
        """Samples of whole paths, in a mix of light groups with these factors (n, 3)."""
        tally = tally_of(traced, factors, diffuse=True)
        return cls(traced.whole(diffuse=True), traced.builder(diffuse=True), tally)

    @cached_property
    def gathering(self) -> Gathering:
        """Made for the first sample that gathers: it guides the sampling of the sky once more."""
        assert self._gather is not None, "there is no light map"
        return self._gather()

    def radiance(
        self, kind: Kind, camera: Camera, size: tuple[int, int], first: int, count: int, seed: int, part: Part
    ) -> Image:
        """Sum (height, width, 3) of radiance, W/(sr m^2), over samples first..first + count - 1 of each pixel."""

        def sums(ray: Any, sampler: Any) -> list[Any]:
            value = self._traced(kind, part, ray, sampler)
            return [dr.select(dr.all(dr.isfinite(value)), value, 0.0)]

        return in_bands(sums, camera, size, first, count, seed)[0]

    def specular_along(self, eye: Floats, directions: Floats, count: int, seed: int, progress: Progress) -> Floats:
        """Mean radiance (k, 3) by lobes of the surfaces seen from `eye` (3,) along unit directions, the sky behind."""
        found = np.empty((len(directions), 3))
        for mine in slices(len(directions), max(1, RAYS_AT_ONCE // count)):
            sampler = SobolSampler.of_pixels(seed, range(mine.start, mine.stop), 0, count)
            rays = rays_from(eye, np.repeat(directions[mine], count, axis=0))
            found[mine] = block_sums(self._traced(Kind.ended, Part.specular, rays, sampler), count) / count
            progress(mine.stop, len(directions), "rays traced")
        return found

    def _traced(self, kind: Kind, part: Part, ray: Any, sampler: Any) -> Any:
        start = path_tracer.camera_start(ray)
        if kind is Kind.path or self._cache is None:
            assert kind is Kind.path and part is Part.full, "there is no light map"
            return path_tracer.radiance_sums(self._scene, sampler, start, self._max_depth, None, self._tally)[0]
        gathers, diffuse = kind is Kind.gathered and part is not Part.specular, mi.Color3f(0.0)
        if gathers:
            si = intersect(self._scene, ray, mi.Bool(True), has_holes(self._scene))
            diffuse = self.gathering.radiance(si, sampler, si.is_valid())
        tally = Shown(self._tally, part, cached_first=not gathers)
        depth = self._max_depth if part is not Part.diffuse else 0 if gathers else 1
        return diffuse + path_tracer.radiance_sums(self._scene, sampler, start, depth, self._cache, tally)[0]

    def guides(self, camera: Camera, size: tuple[int, int], samples: int, seed: int) -> tuple[Image, Image]:
        """Albedo and normals (height, width, 3) for a denoiser; 0 without a surface."""

        def guides(ray: Any, sampler: Any) -> list[Any]:
            return list(self._surfaces.at(intersect(self._scene, ray, mi.Bool(True), has_holes(self._scene))))

        albedo, normal = (sums / np.float32(samples) for sums in in_bands(guides, camera, size, 0, samples, seed))
        return albedo, normal


def in_bands(
    trace: Callable[[Any, Any], list[Any]], camera: Camera, size: tuple[int, int], first: int, count: int, seed: int
) -> list[Image]:
    """Sums (height, width, 3), over samples first..first + count - 1 of each pixel, of what `trace` finds.

    `trace` gets the rays (mi.Ray3f) and the sampler of as many pixels as memory allows at once.
    """
    pixels, parts = size[0] * size[1], []
    for band in slices(pixels, max(1, RAYS_AT_ONCE // count)):
        # Without it the kernel depends on which constants are in use elsewhere, and is often compiled again.
        dr.detail.new_scope(dr.backend_v(mi.Float))
        sampler = SobolSampler.of_pixels(seed, range(band.start, band.stop), first, count)
        ray = camera_rays(camera, size, count, sampler, range(band.start, band.stop))
        found = trace(ray, sampler)
        dr.eval(found)  # at once: each sum would trace the rays again
        parts.append([block_sums(value, count) for value in found])
    return [np.concatenate(sums).reshape(size[1], size[0], 3) for sums in zip(*parts, strict=True)]


def tally_of(traced: TracedScene, factors: Floats | None, *, diffuse: bool) -> path_tracer.Tally:
    """A tally with one sum, of all light in a mix of light groups; None for light as baked."""
    return path_tracer.AllLight() if factors is None else traced.mixed(factors, diffuse=diffuse)


class Shown:
    """A tally of a part of the light, without the cache's light at the first surface unless `cached_first`."""

    def __init__(self, tally: path_tracer.Tally, part: Part, *, cached_first: bool) -> None:
        self._tally, self._part = tally, part
        self._cached_first = cached_first and part is not Part.specular
        self.count, self.begin = tally.count, tally.begin

    def emitted(self, sums: list[Any], light: Any, emitter: Any, w: Any, factor: Any, first: Any) -> list[Any]:
        if self._part is Part.diffuse:
            of_surface = first & ~mi.has_flag(emitter.flags(), mi.EmitterFlags.Infinite)
            light, factor = dr.select(of_surface, light, 0.0), dr.select(of_surface, factor, 0.0)
        if self._part is Part.specular:
            light, factor = dr.select(first, 0.0, light), dr.select(first, 0.0, factor)
        return self._tally.emitted(sums, light, emitter, w, factor, first)

    def cached(self, sums: list[Any], throughput: Any, cache: Any, si: Any, active: Any, first: Any) -> list[Any]:
        if self._part is Part.diffuse:
            active = active & first  # &= would change the path's own
        elif not self._cached_first:
            active = active & ~first
        return self._tally.cached(sums, throughput, cache, si, active, first)


class _SurfaceGuides:
    """What a denoiser is told of surfaces: their approximate reflectance and their normals."""

    def __init__(self, builder: SceneBuilder) -> None:
        self._numbers = builder.numbers
        looks = {name: _look(one, builder.edited.get(name)) for name, one in builder.scene.materials.items()}
        table = np.array([looks[o.material] for o in builder.scene.objects], np.float32)
        self._diffuse, self._specular = (mi.Color3f(np.ascontiguousarray(column.T)) for column in table.swapaxes(0, 1))
        self._textured = any(t.diffuse or t.specular for t in builder.scene.textures.values())

    def at(self, si: Any) -> tuple[Any, Any]:
        hit, bsdf = si.is_valid(), si.bsdf()
        number = self._numbers.at(si, hit)
        albedo = mi.Color3f(0.0)
        for values, texture in ((self._diffuse, DIFFUSE_ATTRIBUTE), (self._specular, SPECULAR_ATTRIBUTE)):
            share = bsdf.eval_attribute_3(texture, si, hit) if self._textured else mi.Color3f(1.0)
            albedo += dr.gather(mi.Color3f, values, number, hit) * share
        normal = bsdf.eval_attribute_3(NORMAL_ATTRIBUTE, si, hit)
        return dr.select(hit, dr.clip(albedo, 0, 1), 0.0), dr.select(hit, normal, 0.0)


def _look(material: Material, edited: Editable | None) -> Floats:
    """(2, 3) approximate reflectance of the diffuse term and of all others; for lobes, at normal incidence."""
    if edited is None:
        specular = sum((np.multiply(lobe.k, lobe.r0) for lobe in material.lobes), np.zeros(3))
        return np.stack([np.broadcast_to(material.kd, 3), specular])
    found = np.zeros((2, 3))
    for term in edited.terms:
        found[0 if term.is_diffuse else 1] += term_albedo(term, edited.curves)
    return found


def camera_rays(camera: Camera, size: tuple[int, int], samples: int, sampler: Any, pixels: range | None = None) -> Any:
    """mi.Ray3f through random places of all pixels, or these, `samples` for each, pixel after pixel.

    Neither camera nor size is a constant of the kernel: other views reuse it.
    """
    pixels = pixels or range(size[0] * size[1])
    width, height, each, begin = (dr.opaque(mi.UInt32, value) for value in (*size, samples, pixels.start))
    count = len(pixels) * samples
    pixel = begin + dr.arange(mi.UInt32, count) // each
    row = pixel // width
    jitter = sampler.next_2d()
    x = (mi.Float(pixel - row * width) + jitter.x) / mi.Float(width) * 2 - 1
    y = 1 - (mi.Float(row) + jitter.y) / mi.Float(height) * 2
    across, up, forward = (_opaque(mi.Vector3f, axis) for axis in image_plane(camera, *size))
    origin = _opaque(mi.Point3f, camera.position) + dr.zeros(mi.Point3f, count)
    return mi.Ray3f(origin, dr.normalize(across * x + up * y + forward))


def _opaque(kind: Any, components: ArrayLike) -> Any:
    """mi.Vector3f or mi.Point3f that kernels read from memory."""
    return kind(*(dr.opaque(mi.Float, float(x)) for x in np.asarray(components)))
