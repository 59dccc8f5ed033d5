"""How an object's probe is best taken and shown: measured, by what viewers really see mirrored in the object.

Rays leave points that viewers see along the mirror direction, and are path traced; the same rays are looked up in the
probe. What is chosen so, and only where it lowers the error to WORTH of what it was:

- A probe leaves its object out, as round things need it, or holds it, as hollow things may, whose surfaces mirror each
  other (the reveal of a window, a frame). Tried where OWN of the rays meet the object itself.
- Look-ups go by bounding planes, or, where those are too near to turn them rightly (a glass beside a bottle), by the
  distance map, which costs more.
- A surface within a niche is shown all that the probe sees, though near things hide most of it. The irradiance of the
  light map knows how much: light from the probe is scaled by its ratio to the irradiance that the probe alone would
  give, at most 1 (Lazarov 2013, "Getting more physical in Call of Duty: Black Ops II", scales by it in both
  directions). A sharp mirror does not gain by that, and then is left as it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake import paths
from lambent.bake.planes import bounding_planes
from lambent.bake.probe import LightMapCache, Probe
from lambent.bake.vectors import array_of, rays_from
from lambent.core.colour import luminance
from lambent.core.cubemap import face_directions, sample, texel_solid_angles
from lambent.core.directions import normalize
from lambent.materials.document import Material

Array = NDArray[np.floating]
RAYS = 2048
LEAST_RAYS = 64  # fewer say nothing
TRIAL_TEXELS, TRIAL_SAMPLES = 32, 8
TRIES = 8  # viewers that are tried for each point
GRAZING = 0.05  # least cosine of a viewer
OWN = 0.15
WORTH = 0.85
CLOSE = 1e-4  # of an object's size
LIFT_M = 1e-4
STEPS, GROWTH, NEAREST = 12, 1.6, 0.05  # of distance_lookup in surface.wgsl
# E(n) of radiance up to the second band is a sum over BASIS of n (Ramamoorthi & Hanrahan 2001, eq. 10): the weight of
# each is the cosine lobe's coefficient times the square of the harmonic's norm.
WEIGHTS = np.array([1 / 4, 1 / 2, 1 / 2, 1 / 2, 15 / 16, 15 / 16, 5 / 64, 15 / 16, 15 / 64])


@dataclass(frozen=True)
class Mirrored:
    """Rays that viewers see mirrored: origins, unit directions and normals (n, 3), radiance (n, 3).

    `irradiance` (n,) is the light map's luminance there, `share` (n,) Fresnel's of the light, and `own` (n,) bool
    whether the object itself is met.
    """

    origins: Array
    directions: Array
    normals: Array
    radiance: Array
    irradiance: Array
    share: Array
    own: NDArray[np.bool_]


def mirrored(
    points: Array, normals: Array, places: Array, material: Material, scene: Any, cache: LightMapCache, depth: int,
    family: list[int], seed: int,
) -> Mirrored | None:  # fmt: skip
    """What viewers at `places` (m, 3) see mirrored in points (n, 3) of unit normals (n, 3): each in one point.

    Of what transmits light they see what is behind: rays go straight on. None where too few points are in view.
    `family` are the numbers of the Mitsuba shapes of the object and of its other parts.
    """
    rng = np.random.default_rng(seed)
    found, eyes = np.zeros(len(points), bool), np.zeros((len(points), 3))
    for _ in range(TRIES if len(places) else 0):
        left = np.flatnonzero(~found)
        if not len(left):
            break
        tried = places[rng.integers(len(places), size=len(left))]
        free = _free(scene, points[left], normals[left], tried)
        eyes[left[free]], found[left[free]] = tried[free], True
    if found.sum() < LEAST_RAYS:
        return None
    at, n = points[found], normals[found]
    view = normalize(eyes[found] - at)
    cosine = (view * n).sum(axis=1, keepdims=True)
    directions = -view if material.transmits else 2 * cosine * n - view
    if material.transmits:
        at = at - 2 * LIFT_M * n  # beyond the sheet
    ray = rays_from(at, directions)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed & 0xFFFFFFFF, len(at))
    value = paths.radiance(scene, sampler, paths.camera_start(ray), depth, cache)
    value = dr.select(dr.all(dr.isfinite(value)), value, 0.0)
    met = scene.ray_intersect_preliminary(ray).shape
    own = np.isin(np.array(dr.reinterpret_array(mi.UInt32, met)), family)
    below = scene.ray_intersect(rays_from(points[found], -n))
    irradiance = array_of(cache.irradiance(below, below.is_valid())).astype(float)
    r0 = max((float(np.mean(lobe.r0)) for lobe in material.lobes), default=1.0)
    share = r0 + (1 - r0) * (1 - np.abs(cosine[:, 0])) ** 5
    return Mirrored(at, directions, n, array_of(value).astype(float), luminance(irradiance), share, own)


def _free(scene: Any, points: Array, normals: Array, eyes: Array) -> NDArray[np.bool_]:
    """Whether nothing stands between points and eyes, on the side of the normals."""
    offset = eyes - points
    ray = rays_from(points, offset)
    ray.maxt = dr.opaque(mi.Float, 1 - 1e-3)
    in_front = (offset * normals).sum(axis=1) > GRAZING * np.linalg.norm(offset, axis=1)
    return in_front & ~np.array(scene.ray_test(ray))


def error(rays: Mirrored, looked_up: Array) -> float:
    """Mean difference of luminances (n,) to what is mirrored, as the eye counts: in log(1 + L/m), m the median."""
    true, shown = luminance(rays.radiance) * rays.share, looked_up * rays.share
    m = max(float(np.median(true)), 1e-6)
    return float(np.abs(np.log1p(shown / m) - np.log1p(true / m)).mean())


def by_planes(rays: Mirrored, radiance: Array, centre: Array, planes: Array) -> Array:
    """Luminance (n,) that rays find in a probe by planes (P, 4) about its centre, as surface.wgsl does."""
    x, w = rays.origins - centre, rays.directions
    height = x @ planes[:, :3].T + planes[:, 3]
    nearness = np.divide(-(w @ planes[:, :3].T), height, out=np.zeros(height.shape), where=height > 1e-6)
    nearness = nearness.max(axis=1, initial=0.0)[:, None]
    looked_up = np.where(nearness > 1e-6, x + w / np.maximum(nearness, 1e-6), w)
    return np.asarray(luminance(sample(radiance.astype(float), normalize(looked_up))))


def by_distance(rays: Mirrored, radiance: Array, centre: Array, distance: Array) -> Array:
    """The same by the distance map (6, N, N), stepped through as distance_lookup of surface.wgsl does."""
    x, w = rays.origins - centre, rays.directions
    length = np.linalg.norm(face_directions(distance.shape[1]), axis=-1)
    inverse = (length / np.clip(distance, 1e-3, None))[..., None]

    def behind(t: Array) -> Array:
        p = x + t[:, None] * w
        return np.asarray(np.abs(p).max(axis=1) * sample(inverse, normalize(p))[:, 0] - 1)

    near, f_near = np.zeros(len(x)), np.full(len(x), -1.0)
    far = np.maximum(np.linalg.norm(x, axis=1), NEAREST / np.maximum(sample(inverse, w)[:, 0], 1e-4))
    f_far = behind(far)
    for _ in range(STEPS - 1):
        on = f_far < 0
        near, f_near = np.where(on, far, near), np.where(on, f_far, f_near)
        far = np.where(on, far * GROWTH, far)
        f_far = np.where(on, behind(far), f_far)
    met = f_far >= 0
    for low, high in ((0.05, 0.95), (0.05, 0.95), (0.05, 0.95), (0.0, 1.0)):
        t = near + (far - near) * (f_near / np.minimum(f_near - f_far, -1e-9)).clip(low, high)
        f = behind(t)
        near, f_near = np.where(f < 0, t, near), np.where(f < 0, f, f_near)
        far, f_far = np.where(f < 0, far, t), np.where(f < 0, f_far, f)
    looked_up = np.where(met[:, None], x + t[:, None] * w, w)
    return np.asarray(luminance(sample(radiance.astype(float), normalize(looked_up))))


def basis_of(n: Array) -> Array:
    """(..., 9) products of the components of unit vectors that WEIGHTS belong to."""
    x, y, z = n[..., 0], n[..., 1], n[..., 2]
    return np.stack([np.ones_like(x), x, y, z, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y], axis=-1)


def irradiance_of(radiance: Array) -> Array:
    """Luminance of the irradiance that a cube of radiance (6, N, N, 3) gives, as a sum (9,) over `basis_of` normals."""
    n = radiance.shape[1]
    w = normalize(face_directions(n)).reshape(-1, 3)
    weighted = luminance(radiance.astype(float)).reshape(-1) * np.broadcast_to(texel_solid_angles(n), (6, n, n)).ravel()
    return np.asarray(WEIGHTS * (weighted @ basis_of(w)))


def open_share(rays: Mirrored, irradiance: Array) -> Array:
    """What the light map has of the irradiance (9,) of a probe, at most 1: (n,)."""
    whole = np.maximum(basis_of(rays.normals) @ irradiance, 1e-6)
    return np.asarray(np.clip(rays.irradiance / whole, 0, 1))


@dataclass(frozen=True)
class Judged:
    """The error of a probe, as it is and with light scaled by `open_share`, and by the distance map in place of planes.

    `irradiance` (9,) is the probe's.
    """

    plain: float
    scaled: float
    irradiance: Array
    distance: float

    @property
    def scales(self) -> bool:
        return self.scaled < WORTH * self.plain

    @property
    def by_planes(self) -> float:
        return self.scaled if self.scales else self.plain

    @property
    def needs_distance(self) -> bool:
        return self.distance < WORTH * self.by_planes

    @property
    def best(self) -> float:
        return self.distance if self.needs_distance else self.by_planes


def judged(
    rays: Mirrored, probe: Probe, centre: Array, planes: Array | None = None, *, through: bool = False
) -> Judged:
    """How well a probe shows what is mirrored, by `planes` (P, 4) about its centre, or those that are found for it.

    What is seen `through` an object is not scaled.
    """
    if planes is None:
        planes = bounding_planes(probe.distance, probe.normals)
    light = by_planes(rays, probe.radiance, centre, planes.astype(float))
    irradiance = irradiance_of(probe.radiance)
    share = np.ones(len(light)) if through else open_share(rays, irradiance)
    plain, scaled = error(rays, light), error(rays, light * share)
    stepped = by_distance(rays, probe.radiance, centre, probe.distance.astype(float))
    distance = error(rays, stepped * (share if scaled < WORTH * plain else 1.0))
    return Judged(plain, scaled, irradiance, distance)
