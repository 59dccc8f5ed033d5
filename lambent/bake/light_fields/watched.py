"""What viewers see mirrored in an object, and how far a probe or a light field is from it.

Points all over the object, each seen by one viewer; directions spread as its widest lobe spreads them are path traced,
and the mean over them is compared with the mean over look-ups: a rough surface blurs what look-ups confuse.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.bake.light_fields.acquisition import Around
from lambent.bake.light_fields.sampling import spread_evenly
from lambent.bake.probes.selection import difference, light_along, spread_mirrored, viewers_of, widest_lobe
from lambent.bake.tracing.rays import array_of, leaving, towards
from lambent.core.arrays import Floats
from lambent.core.colour import luminance
from lambent.core.directions import normalize
from lambent.core.geometry import triangle_areas
from lambent.materials.document import Material
from lambent.materials.lobes import fresnel
from lambent.scenes.scene import Mesh

POINTS, SPREAD, LEAST = 384, 8, 32  # points, directions from each, points in view below which nothing is known
TRIES = 4  # viewers for each point, of whom those who see it tell how large the object is


@dataclass(frozen=True)
class Watched:
    """n points x of unit normals `normals`, (n, 3); rays from them, origins and unit directions, (n, SPREAD, 3).

    `light` (n, 3) is the mean radiance that they bring, `share` (n,) the share of it that the surface reflects, and
    `size_sr` how much of a viewer's sphere the object takes, on average over all viewers.
    """

    x: Floats
    normals: Floats
    origins: Floats
    directions: Floats
    light: Floats
    share: Floats
    size_sr: float

    def error(self, shown: Floats) -> float:
        """Mean difference of means (n, 3) that are shown, as `probes.selection.error`."""
        return float(difference(luminance(shown) * self.share, luminance(self.light) * self.share).mean())


def watched(mesh: Mesh, material: Material, places: Floats, around: Around, seed: int) -> Watched | None:
    """What viewers at `places` (m, 3) see mirrored in a mesh; None where they see too little of it."""
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
    w = spread_mirrored(view, n, widest_lobe(material), SPREAD, rng)
    ray = leaving(around.scene, np.repeat(x, SPREAD, axis=0), np.repeat(n, SPREAD, axis=0), w.reshape(-1, 3))
    light = light_along(around.scene, ray, around.depth, around.cache, seed).reshape(w.shape)
    origins = array_of(ray.o).astype(float).reshape(w.shape)
    cosine = np.abs((view * n).sum(axis=1))
    lobes = [(float(np.mean(lobe.k)), float(np.mean(lobe.r0))) for lobe in material.lobes]
    share = sum((k * fresnel(cosine, r0) for k, r0 in lobes), np.zeros(len(x)))
    return Watched(x, n, origins, w, light.mean(axis=1), share, size_sr)


def _size_sr(
    points: Floats, normals: Floats, places: Floats, around: Around, rng: np.random.Generator
) -> float:  # of a square metre of the surface
    p, n = np.repeat(points, TRIES, axis=0), np.repeat(normals, TRIES, axis=0)
    eyes = places[rng.integers(len(places), size=len(p))]
    offset = eyes - p
    distance = np.maximum(np.linalg.norm(offset, axis=1), 1e-6)
    cosine = (offset * n).sum(axis=1) / distance
    free = (cosine > 0) & ~np.array(around.scene.ray_test(towards(around.scene, p, n, eyes)))
    return float(np.minimum(np.where(free, cosine, 0.0) / distance**2, 1e6).mean())
