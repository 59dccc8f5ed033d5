"""What viewers see of an object by its lobes, and how far a probe or a light field is from it.

Points all over the object, each seen by one viewer; directions spread as the widest lobe of each side spreads them are
path traced. What the whole surface shows with them is compared with what it shows by look-ups: rough surfaces blur what
look-ups confuse, and diffuse light hides it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import drjit as dr
import numpy as np

from lambent.baking.light_fields.acquisition import Surroundings
from lambent.baking.light_fields.sampling import spread_evenly
from lambent.baking.probes.selection import light_along, spread_mirrored, viewers_of
from lambent.baking.tracing.rays import array_of, leaving, rays_from, towards
from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.triangles import triangle_areas
from lambent.core.light.colour import luminance
from lambent.materials.document import Lobe, Material
from lambent.materials.lobes import tint, widths
from lambent.scenes.scene import Mesh

POINTS, SPREAD, LEAST = 768, 8, 32  # points, directions of each side, points in view below which nothing is known
PATHS = 4  # along each direction, whose mean is its light
TRIES = 4  # viewers for each point, of whom those who see it tell how large the object is


@dataclass(frozen=True)
class Watched:
    """n points x of unit normals `normals`, (n, 3); rays from them, origins and unit directions, (n, S, 3).

    `share` (n, S, 3) is what the surface shows of each ray's light, RGB, `own` (n, 3) its diffuse radiance, `light`
    (n, 3) the radiance of the whole, and `irradiance` (n,) that of the light map, its luminance; 0 where there is none.
    `size_sr` is how much of a viewer's sphere the object takes, on average over all viewers.
    """

    x: Floats
    normals: Floats
    origins: Floats
    directions: Floats
    share: Floats
    own: Floats
    light: Floats
    irradiance: Floats
    size_sr: float

    @property
    def level(self) -> float:
        """Median luminance."""
        return max(float(np.median(luminance(self.light))), 1e-6)

    def error(self, along: Floats, level: float) -> float:
        """Mean difference of what is shown, RGB, in log(1 + L/level), for light (n, S, 3) that look-ups find."""
        return float(self.errors(along, level).mean())

    def errors(self, along: Floats, level: float) -> Floats:
        """The differences whose mean is `error`, (n,), one a point."""
        shown = self.own + (self.share * along).sum(axis=1)
        return np.asarray(np.abs(np.log1p(shown / level) - np.log1p(self.light / level)).mean(axis=1))

    def halves(self) -> tuple[Flags, Flags]:
        """Every other point (n,): those that decide, and those that are held out."""
        first = np.arange(len(self.x)) % 2 == 0
        return first, ~first

    def of(self, which: Flags) -> Watched:
        """Some of the points."""
        names = "x", "normals", "origins", "directions", "share", "own", "light", "irradiance"
        return replace(self, **{name: getattr(self, name)[which] for name in names})


def watched(mesh: Mesh, material: Material, places: Floats, around: Surroundings, seed: int) -> Watched | None:
    """What viewers at `places` (m, 3) see of a mesh; None where they see too little of it."""
    rng = np.random.default_rng(seed)
    spots = spread_evenly(mesh, POINTS, rng)
    if not len(spots) or not len(places):
        return None
    found, eyes = viewers_of(spots.positions, spots.normals, places, around.scene, rng)
    if found.sum() < LEAST:
        return None
    area_m2 = float(triangle_areas(mesh.corners).sum())
    size_sr = _size_sr(spots.positions, spots.normals, places, around, rng) * area_m2
    x, n = spots.positions[found], spots.normals[found]
    view = normalize(eyes[found] - x)
    w, share = _rays_of_lobes(material, view, n, rng)
    if not w.shape[1]:
        return None
    count = w.shape[1]
    ray = leaving(around.scene, np.repeat(x, count, axis=0), np.repeat(n, count, axis=0), w.reshape(-1, 3))
    origins = array_of(ray.o).astype(float).reshape(w.shape)
    paths = rays_from(np.repeat(origins.reshape(-1, 3), PATHS, axis=0), np.repeat(w.reshape(-1, 3), PATHS, axis=0))
    traced = light_along(around.scene, paths, around.depth, around.cache, seed)
    light = traced.reshape(*w.shape[:2], PATHS, 3).mean(axis=2)
    own, irradiance = _diffuse(around, x, n)
    return Watched(x, n, origins, w, share, own, own + (share * light).sum(axis=1), irradiance, size_sr)


def _rays_of_lobes(material: Material, view: Floats, n: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """(n, S, 3) directions that viewers see mirrored, and through the surface, and what is shown of each, RGB."""
    cosine = np.abs((view * n).sum(axis=1))[:, None]
    directions: list[Floats] = [np.zeros((len(n), 0, 3))]
    shares = list(directions)
    for through in (False, True):
        lobes = [one for one in material.lobes if (one.side == "transmission") == through and not one.retro]
        if not lobes:
            continue
        w = spread_mirrored(view, n, max(math.prod(widths(one)) ** 0.5 for one in lobes), SPREAD, rng)
        if through:
            w = w - 2 * (w * n[:, None]).sum(axis=-1, keepdims=True) * n[:, None]
        share = sum((_shown(lobe, cosine) for lobe in lobes), np.zeros((len(n), 3)))
        directions.append(w)
        shares.append(np.repeat(share[:, None] / SPREAD, SPREAD, axis=1))
    return np.concatenate(directions, axis=1), np.concatenate(shares, axis=1)


def _shown(lobe: Lobe, cosine: Floats) -> Floats:
    """(n, 3) share of light that a lobe passes on."""
    return np.concatenate([tint(cosine, lobe, c) for c in range(3)], axis=1)


def _diffuse(around: Surroundings, x: Floats, n: Floats) -> tuple[Floats, Floats]:
    """Diffuse radiance (n, 3) of surface points, and the luminance (n,) of their irradiance, by the light map."""
    if around.cache is None:
        return np.zeros(x.shape), np.zeros(len(x))
    start = array_of(leaving(around.scene, x, n, n).o)
    si = around.scene.ray_intersect(rays_from(start, -n))
    light, irradiance = around.cache(si, si.is_valid()), around.cache.irradiance(si, si.is_valid(), direct=False)
    dr.eval(light, irradiance)
    own, lit = (np.nan_to_num(array_of(found).astype(float), posinf=0.0) for found in (light, irradiance))
    return own, np.asarray(luminance(lit))  # a texel without light, or a triangle without area, may be no number


def _size_sr(
    points: Floats, normals: Floats, places: Floats, around: Surroundings, rng: np.random.Generator
) -> float:  # of a square metre of the surface
    p, n = np.repeat(points, TRIES, axis=0), np.repeat(normals, TRIES, axis=0)
    eyes = places[rng.integers(len(places), size=len(p))]
    offset = eyes - p
    distance = np.maximum(np.linalg.norm(offset, axis=1), 1e-6)
    cosine = (offset * n).sum(axis=1) / distance
    free = (cosine > 0) & ~np.array(around.scene.ray_test(towards(around.scene, p, n, eyes)))
    return float(np.minimum(np.where(free, cosine, 0.0) / distance**2, 1e6).mean())
