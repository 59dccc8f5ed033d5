"""What viewers can see: of texels that lie across an occluder, the part that shows decides.

A texel of some centimetres may reach behind a wall, above a ceiling or under a thing that stands on it. The light there
is another than on the part in view, a thousand times as much where the sky shines on it, and one value cannot hold
both. Points are hidden if none of many places where a viewer may stand sees them.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake.texels import BEYOND, POINTS, Texels
from lambent.bake.vectors import array_of, rays_from, vectors
from lambent.core.directions import basis
from lambent.core.sequences import cosine_hemisphere, r2
from lambent.scenes.scene import Scene

Array = NDArray[np.floating]
Mask = NDArray[np.bool_]
PLACES = 256
FEW = (8, 32, 96)  # places that are tried before all are; most points are seen from one of the first
RAYS_AT_ONCE = 1 << 21
SHORT = 1e-4  # of a ray's length, and metres, by which it begins and ends beside surfaces


def viewing_places(scene: Scene, traced: Any) -> Array:
    """Free places (PLACES, 3) in what the scene's cameras see: along their rays, and along those that go on diffusely.

    Rays that meet nothing have no places. (0, 3) where there are no cameras, or they see nothing.
    """
    cameras = [*scene.cameras, *(camera for path in scene.paths for camera in path.keys)]
    if not cameras:
        return np.zeros((0, 3))
    u = r2(8 * PLACES)
    eyes = np.array([c.position for c in cameras], float)[np.arange(len(u)) % len(cameras)]
    z = 1 - 2 * u[:, 0]
    phi = 2 * np.pi * u[:, 1]
    around = np.stack([np.sqrt(1 - z**2) * np.cos(phi), z, np.sqrt(1 - z**2) * np.sin(phi)], axis=-1)
    first, hits, normals = _hits(traced, eyes, around)
    t, b = basis(normals)
    local = cosine_hemisphere(r2(len(first)))
    onwards = local[:, :1] * t + local[:, 1:2] * b + local[:, 2:] * normals
    start = hits + SHORT * normals
    second, further, _ = _hits(traced, start, onwards)
    share = np.random.default_rng(0).random((len(u), 1))
    places = np.concatenate([eyes[first] + share[: len(first)] * (hits - eyes[first]),
                             start[second] + share[: len(second)] * (further - start[second])])  # fmt: skip
    return places[np.random.default_rng(1).permutation(len(places))[:PLACES]]


def _hits(traced: Any, origins: Array, directions: Array) -> tuple[NDArray[np.integer], Array, Array]:
    """Which rays hit the front or back of something, where (n, 3), and the unit normals on the rays' side (n, 3)."""
    si = traced.ray_intersect(rays_from(origins, directions))
    hit = np.flatnonzero(np.array(si.is_valid()))
    normals = array_of(si.n)[hit].astype(float)
    normals *= -np.sign((normals * directions[hit]).sum(axis=1, keepdims=True))
    return hit, array_of(si.p)[hit].astype(float), normals


def seen(traced: Any, places: Array, positions: Array, normals: Array) -> Mask:
    """(n,) bool: whether points (n, 3) are seen from a place, on the side of their normals (n, 3)."""
    found = np.zeros(len(positions), bool)
    for some in np.split(places, FEW):
        left = np.flatnonzero(~found)
        found[left] = _seen_from(traced, some, positions[left], normals[left])
    return found


def _seen_from(traced: Any, places: Array, positions: Array, normals: Array) -> Mask:
    found = np.zeros(len(positions), bool)
    if not len(places):
        return found
    at_once = max(1, RAYS_AT_ONCE // len(places))
    eyes, count = vectors(mi.Point3f, places), dr.opaque(mi.UInt32, len(places))
    for first in range(0, len(positions), at_once):
        mine = slice(first, first + at_once)
        thread = dr.arange(mi.UInt32, len(positions[mine]) * len(places))
        point = thread // count
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(thread))
        si.p = dr.gather(mi.Point3f, vectors(mi.Point3f, positions[mine]), point)
        si.n = mi.Normal3f(dr.gather(mi.Vector3f, vectors(mi.Vector3f, normals[mine]), point))
        eye = dr.gather(mi.Point3f, eyes, thread - point * count)
        front = dr.dot(eye - si.p, si.n) > 0
        free = front & ~traced.ray_test(si.spawn_ray_to(eye), front)
        found[mine] = np.array(dr.block_sum(dr.select(free, 1.0, 0.0), len(places))) > 0
    return found


def without_hidden(
    texels: Texels, valid: Mask, in_view: Mask, labels: NDArray[np.integer]
) -> tuple[Mask, NDArray[np.integer]]:
    """Leave to every texel the points that are in view, if it has any.

    Texels without, next to one with them, are left to be filled from there: look-ups near the border read them, too.
    Others are kept, as the hidden part of their chart.

    Parameters
    ----------
    valid, in_view : (K, POINTS) bool
        Which points can be lit at all, and which are seen.
    labels : (H, W) int
        Chart of each texel, -1 in gutters.

    Returns
    -------
    valid : (K, POINTS) bool
    labels : (H, W) int
        With BEYOND added for hidden texels.
    """
    assert valid.shape[1] == POINTS
    shown = valid & in_view
    has_shown = shown.any(axis=1)
    chart = labels.reshape(-1)[texels.index]
    beside = _beside(labels, texels.index[has_shown]).reshape(-1)[texels.index] & ~has_shown
    hidden = ~has_shown & ~beside & valid.any(axis=1)
    parted = labels.reshape(-1).copy()
    parted[texels.index[hidden]] = chart[hidden] + BEYOND
    kept = np.where(has_shown[:, None], shown, valid & ~beside[:, None])
    return kept, parted.reshape(labels.shape)


def _beside(labels: NDArray[np.integer], index: NDArray[np.integer]) -> Mask:
    """(H, W) bool: texels next to one of the given, also across corners, in the same chart."""
    height, width = labels.shape
    padded = np.pad(labels, 1, constant_values=-1)
    marked = np.zeros(labels.size, bool)
    marked[index] = True
    around = np.pad(marked.reshape(labels.shape), 1)
    result = np.zeros(labels.shape, bool)
    for r in range(3):
        for c in range(3):
            near = slice(r, r + height), slice(c, c + width)
            result |= around[near] & (padded[near] == labels)
    return result
