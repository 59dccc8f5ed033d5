"""Choices for taking and looking up a probe, judged by rays that viewers see mirrored in its object.

Rays leave visible points along the mirror direction and are path traced; the same rays are looked up in the probe. The
error decides the following choices, each made if it lowers the error to WORTH:

- A probe leaves its object out, as convex objects need it, or keeps it, as hollow ones may, whose surfaces mirror each
  other (a window reveal, a frame). Tried if a share OWN of the rays hits the object itself.
- Look-ups use bounding planes, or the more expensive distance map if planes turn them wrongly (a glass beside a
  bottle).
- Specular occlusion scales the probe's light by the ratio of the light map's irradiance to the irradiance of the probe
  alone, at most 1 (Lazarov 2013, "Getting more physical in Call of Duty: Black Ops II"). Within a niche, nearby things
  hide most of the probe's light. Sharp mirrors do not benefit and stay unscaled. If only some places are niches
  (shelves under a metal table), twice the ratio preserves the light elsewhere.
- A niche sees its own walls, about equally bright everywhere, where they hide the probe (`even`): if the open share is
  the square of the ratio r, the walls' radiance is (1 - r)/(1 - r^2) E/pi, and the light along a ray is the mean of
  both, r^2 L + (1 - r) E/pi. Its irradiance, and its colour, are those of the light map.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np

from lambent.baked.probes.irradiance import basis_of, irradiance_of
from lambent.baked.probes.lookups import distance_lookup, inverse_depth, planes_lookup
from lambent.baking.light.cache import LightMapCache
from lambent.baking.probes.planes import bounding_planes
from lambent.baking.probes.probe import Probe
from lambent.baking.tracing import path_tracer
from lambent.baking.tracing.rays import array_of, independent, leaving, rays_from, towards
from lambent.baking.tracing.shapes import ObjectNumbers
from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.cubemap import sample
from lambent.core.geometry.directions import basis, normalize, reflect
from lambent.core.light.colour import luminance
from lambent.materials.document import Material
from lambent.materials.lobes import fresnel, widths

RAYS = 2048
LEAST_RAYS = 64  # fewer are not significant
TRIAL_TEXELS, TRIAL_SAMPLES = 32, 8
TRIES = 8  # viewers tried per point
GRAZING = 0.05  # least cosine towards a viewer
OWN = 0.15
WORTH = 0.85


@dataclass(frozen=True)
class Mirrored:
    """Rays that viewers see mirrored: origins, unit directions and normals (n, 3), radiance (n, 3).

    `irradiance` (n,) is the light map's luminance there, without the sun, `fresnel` (n,) is Schlick's term, and `own`
    (n,) whether the ray hits the object itself.
    """

    origins: Floats
    directions: Floats
    normals: Floats
    radiance: Floats
    irradiance: Floats
    fresnel: Floats
    own: Flags


def mirrored(
    points: Floats, normals: Floats, clear: Flags, r0: Floats, places: Floats, scene: Any, cache: LightMapCache,
    depth: int, numbers: ObjectNumbers, family: list[int], seed: int,
) -> Mirrored | None:  # fmt: skip
    """Rays that viewers at `places` (m, 3) see mirrored in points (n, 3) of unit normals (n, 3), one viewer per point.

    At `clear` (n,) materials rays continue straight; `r0` (n,) is the reflectance at normal incidence. None if too few
    points are in view. `family` are the indices in the scene of the objects and of their other parts.
    """
    found, eyes = viewers_of(points, normals, places, scene, np.random.default_rng(seed))
    if found.sum() < LEAST_RAYS:
        return None
    at, n = points[found], normals[found]
    view = normalize(eyes[found] - at)
    directions = np.where(clear[found, None], -view, reflect(view, n))
    ray = leaving(scene, at, n, directions)
    radiance = light_along(scene, ray, depth, cache, seed)
    met = scene.ray_intersect_preliminary(ray)
    own = np.array(met.is_valid()) & np.isin(np.array(numbers.at(met, met.is_valid())), family)
    below = scene.ray_intersect(rays_from(array_of(leaving(scene, at, n, n).o), -n))
    lit = array_of(cache.irradiance(below, below.is_valid(), direct=False)).astype(float)
    irradiance = np.nan_to_num(lit, posinf=0.0)
    share = np.asarray(fresnel(np.abs((view * n).sum(axis=1)), r0[found]))
    return Mirrored(array_of(ray.o).astype(float), directions, n, radiance, luminance(irradiance), share, own)


def largest_r0(material: Material) -> float:
    """Reflectance at normal incidence of a material's brightest lobe, averaged over channels; 1 without lobes."""
    return max((float(np.mean(lobe.r0)) for lobe in material.lobes), default=1.0)


def widest_lobe(material: Material) -> float:
    """Roughness sqrt(mx my) of a material's widest lobe; 0 without lobes."""
    return max((math.prod(widths(lobe)) ** 0.5 for lobe in material.lobes), default=0.0)


def spread_mirrored(view: Floats, n: Floats, roughness: float, spread: int, rng: np.random.Generator) -> Floats:
    """(k, spread, 3) directions above surfaces of normals n (k, 3), mirrored at facets with Beckmann slopes."""
    t, b = basis(n)
    slope = roughness / np.sqrt(2) * rng.standard_normal((2, len(n), spread, 1))
    facet = normalize(n[:, None] + slope[0] * t[:, None] + slope[1] * b[:, None])
    w = reflect(np.broadcast_to(view[:, None], facet.shape), facet)
    below = np.minimum((w * n[:, None]).sum(axis=-1, keepdims=True), 0)
    return np.asarray(w - 2 * below * n[:, None])


def light_along(scene: Any, ray: Any, depth: int, cache: LightMapCache | None, seed: int) -> Floats:
    """Radiance (k, 3) of one path along each ray; nonfinite values become black."""
    sampler = independent(seed & 0xFFFFFFFF, dr.width(ray.o))
    value = path_tracer.radiance(scene, sampler, path_tracer.camera_start(ray), depth, cache)
    return array_of(dr.select(dr.all(dr.isfinite(value)), value, 0.0)).astype(float)


def viewers_of(
    points: Floats, normals: Floats, places: Floats, scene: Any, rng: np.random.Generator
) -> tuple[Flags, Floats]:
    """Flags of points (n, 3), of unit normals (n, 3), seen from one of the tried `places` (m, 3), and that place."""
    found, eyes = np.zeros(len(points), bool), np.zeros((len(points), 3))
    for _ in range(TRIES if len(places) else 0):
        left = np.flatnonzero(~found)
        if not len(left):
            break
        tried = places[rng.integers(len(places), size=len(left))]
        free = _free(scene, points[left], normals[left], tried)
        eyes[left[free]], found[left[free]] = tried[free], True
    return found, eyes


def _free(scene: Any, points: Floats, normals: Floats, eyes: Floats) -> Flags:
    """Whether points and eyes see each other, on the side of the normals."""
    offset = eyes - points
    in_front = (offset * normals).sum(axis=1) > GRAZING * np.linalg.norm(offset, axis=1)
    return np.asarray(in_front & ~np.array(scene.ray_test(towards(scene, points, normals, eyes))))


def error(rays: Mirrored, looked_up: Floats) -> float:
    """Mean difference between luminances (n,) and those of the rays."""
    return float(difference(looked_up * rays.fresnel, luminance(rays.radiance) * rays.fresnel).mean())


def difference(shown: Floats, true: Floats) -> Floats:
    """Differences (n,) of luminances (n,) in log(1 + L/m), m the median of the true ones, as perceived."""
    m = max(float(np.median(true)), 1e-6)
    return np.asarray(np.abs(np.log1p(shown / m) - np.log1p(true / m)))


def by_planes(rays: Mirrored, radiance: Floats, centre: Floats, planes: Floats) -> Floats:
    """Luminance (n,) that rays find in a probe by planes (P, 4) relative to its centre."""
    return _found(radiance, planes_lookup(rays.origins - centre, rays.directions, planes))


def by_distance(rays: Mirrored, radiance: Floats, centre: Floats, distance: Floats) -> Floats:
    """Luminance (n,) that rays find in a probe by its distance map (6, N, N)."""
    return _found(radiance, distance_lookup(rays.origins - centre, rays.directions, inverse_depth(distance)))


def _found(radiance: Floats, directions: Floats) -> Floats:
    return np.asarray(luminance(sample(radiance.astype(float), normalize(directions))))


def specular_occlusion(lit: Floats, normals: Floats, irradiance: Floats) -> Floats:
    """Ratio (n,), at most 1, of the light map's irradiance `lit` (n,) to the probe's (9,), for normals (n, 3)."""
    whole = np.maximum(basis_of(normals) @ irradiance, 1e-6)
    return np.asarray(np.clip(lit / whole, 0, 1))


@dataclass(frozen=True)
class Scaling:
    """Scaling of a probe's light by the light map: `gain` times `specular_occlusion`; `even` adds the walls of niches.

    A gain of 0 leaves light unscaled.
    """

    gain: float
    even: bool = False

    def shown(self, light: Floats, lit: Floats, normals: Floats, irradiance: Floats) -> Floats:
        """Light (n, ...) along rays that find `light` (n, ...) in a probe of `irradiance` (9,).

        The rays begin at surfaces of `normals` (n, 3), with light map luminance `lit` (n,).
        """
        if self.gain == 0:
            return light
        each = (len(lit), *[1] * (light.ndim - 1))
        share = specular_occlusion(lit, normals, irradiance / self.gain).reshape(each)
        if not self.even:
            return light * share
        return np.asarray(light * share**2 + (1 - share) * lit.reshape(each) / np.pi)


UNSCALED, PLAIN = Scaling(0.0), Scaling(1.0)
SCALINGS = {  # factor to which each must lower the error
    PLAIN: WORTH,
    Scaling(2.0): 0.95,
    Scaling(1.0, even=True): 0.95,
    Scaling(1.5, even=True): 0.95,
}


@dataclass(frozen=True)
class Judged:
    """Errors of a probe, looked up by planes and by the distance map, with the `scaling`.

    `irradiance` (9,) is the probe's.
    """

    by_planes: float
    scaling: Scaling
    irradiance: Floats
    distance: float

    @property
    def needs_distance(self) -> bool:
        return self.distance < WORTH * self.by_planes

    @property
    def best(self) -> float:
        return self.distance if self.needs_distance else self.by_planes


def judged(
    rays: Mirrored, probe: Probe, centre: Floats, planes: Floats | None = None, *, through: bool = False
) -> Judged:
    """Errors of a probe in mirrored rays, by `planes` (P, 4) relative to its centre, or by planes found for it.

    Light seen `through` an object is not scaled.
    """
    if planes is None:
        planes = bounding_planes(probe.distance, probe.normals)
    light = by_planes(rays, probe.radiance, centre, planes.astype(float))
    irradiance = irradiance_of(probe.radiance)
    errors = {UNSCALED: error(rays, light)}
    for scaling, most in () if through else SCALINGS.items():
        found = error(rays, scaling.shown(light, rays.irradiance, rays.normals, irradiance))
        if found < most * errors[UNSCALED]:
            errors[scaling] = found
    best = min(errors, key=lambda one: round(errors[one], 4))  # of equal ones, the simplest
    marched = by_distance(rays, probe.radiance, centre, probe.distance.astype(float))
    by_distances = error(rays, best.shown(marched, rays.irradiance, rays.normals, irradiance))
    return Judged(errors[best], best, irradiance, by_distances)
