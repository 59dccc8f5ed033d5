"""Visibility of the light map's points to viewers.

A texel of some centimetres may extend behind a wall, above a ceiling or under an object. The light there can differ
from the visible part by a factor of a thousand, under the sky for example, and one value cannot represent both: the
visible part decides. A point is hidden if it is seen from none of many possible positions of a viewer.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.running.tiles import slices
from lambent.baking.surfaces.texels import BEYOND, POINTS, Texels
from lambent.baking.tracing.rays import (
    APPROACH,
    array_of,
    cosine_directions,
    distances,
    leaving,
    rays_from,
    towards,
    vectors,
)
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry.sequences import r2
from lambent.scenes.scene import Scene

PLACES = 256
FEW = (8, 32, 96)  # positions tried before all the others; most points are seen from one of the first
RAYS_AT_ONCE = 1 << 21
COVERED_M = 2e-3  # largest distance of a surface that covers a point


def camera_eyes(scene: Scene) -> Floats:
    """Positions (n, 3) of the scene's cameras and of the keys of its paths."""
    cameras = [*scene.cameras, *(key for path in scene.paths for key in path.keys)]
    return np.array([camera.position for camera in cameras], float).reshape(-1, 3)


def viewing_places(scene: Scene, traced: Any) -> Floats:
    """Free positions (PLACES, 3) in view of the scene's cameras: along their rays, and along one diffuse bounce.

    Rays without a hit give no positions. (0, 3) without cameras, or if they see nothing.
    """
    eyes, u = camera_eyes(scene), r2(8 * PLACES)
    if not len(eyes):
        return eyes
    eyes = eyes[np.arange(len(u)) % len(eyes)]
    z = 1 - 2 * u[:, 0]
    phi = 2 * np.pi * u[:, 1]
    around = np.stack([np.sqrt(1 - z**2) * np.cos(phi), z, np.sqrt(1 - z**2) * np.sin(phi)], axis=-1)
    first, hits, normals = _hits(traced, rays_from(eyes, around))
    second, further, _ = _hits(traced, leaving(traced, hits, normals, cosine_directions(normals)))
    share = np.random.default_rng(0).random((len(u), 1))
    places = np.concatenate([eyes[first] + share[: len(first)] * (hits - eyes[first]),
                             hits[second] + share[: len(second)] * (further - hits[second])])  # fmt: skip
    return places[np.random.default_rng(1).permutation(len(places))[:PLACES]]


def _hits(traced: Any, ray: Any) -> tuple[Indices, Floats, Floats]:
    """Which rays hit something, front or back, the hits (n, 3), and unit normals on the rays' side (n, 3)."""
    si = traced.ray_intersect(ray)
    hit = np.flatnonzero(np.array(si.is_valid()))
    normals = array_of(si.n)[hit].astype(float)
    normals *= -np.sign((normals * array_of(ray.d)[hit]).sum(axis=1, keepdims=True))
    return hit, array_of(si.p)[hit].astype(float), normals


def seen(traced: Any, places: Floats, positions: Floats, normals: Floats) -> Flags:
    """(n,) bool: whether points (n, 3) are seen from any of `places`, on the side of their normals (n, 3).

    Through the gap below a flush surface, such as a poster's, points near its border would be seen: they count as
    hidden.
    """
    found, covered = np.zeros(len(positions), bool), _covered(traced, positions, normals)
    for some in np.split(places, FEW):
        left = np.flatnonzero(~(found | covered))
        found[left] = _seen_from(traced, some, positions[left], normals[left])
    return found


def _covered(traced: Any, positions: Floats, normals: Floats) -> Flags:
    """(n,) whether something lies as close above points (n, 3) of unit normals (n, 3) as flush faces are raised."""
    box = traced.bbox()
    reach = min(APPROACH * (1 + np.abs([box.min, box.max]).max()), COVERED_M)
    return np.asarray(distances(traced, leaving(traced, positions, normals, normals)) < reach)


def _seen_from(traced: Any, places: Floats, positions: Floats, normals: Floats) -> Flags:
    found = np.zeros(len(positions), bool)
    if not len(places):
        return found
    at_once = max(1, RAYS_AT_ONCE // len(places))
    eyes, count = vectors(mi.Point3f, places), dr.opaque(mi.UInt32, len(places))
    for mine in slices(len(positions), at_once):
        thread = dr.arange(mi.UInt32, len(positions[mine]) * len(places))
        point = thread // count
        p = dr.gather(mi.Point3f, vectors(mi.Point3f, positions[mine]), point)
        n = dr.gather(mi.Vector3f, vectors(mi.Vector3f, normals[mine]), point)
        eye = dr.gather(mi.Point3f, eyes, thread - point * count)
        front = dr.dot(eye - p, n) > 0
        free = front & ~traced.ray_test(towards(traced, p, n, eye), front)
        found[mine] = np.array(dr.block_sum(dr.select(free, 1.0, 0.0), len(places))) > 0
    return found


def without_hidden(texels: Texels, valid: Flags, in_view: Flags, labels: Indices) -> tuple[Flags, Indices]:
    """Restrict every texel to its visible points, if it has any.

    Hidden texels next to visible ones are left unknown, to be filled from these: bilinear look-ups near the border read
    them too. Other hidden texels are kept, as the hidden part of their chart.

    Parameters
    ----------
    valid, in_view : (K, POINTS) bool
        Points that can be lit at all, and visible points.
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
    has_shown = np.asarray(shown.any(axis=1))
    chart = labels.reshape(-1)[texels.index]
    adjacent = np.asarray(_adjacent(labels, texels.index[has_shown]).reshape(-1)[texels.index] & ~has_shown)
    hidden = ~has_shown & ~adjacent & valid.any(axis=1)
    parted = labels.reshape(-1).copy()
    parted[texels.index[hidden]] = chart[hidden] + BEYOND
    kept = np.where(has_shown[:, None], shown, valid & ~adjacent[:, None])
    return kept, parted.reshape(labels.shape)


def _adjacent(labels: Indices, index: Indices) -> Flags:
    """(H, W) bool: texels adjacent to one of `index`, corners included, in the same chart."""
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
