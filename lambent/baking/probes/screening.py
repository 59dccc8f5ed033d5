"""Screening of all objects for those that may need more than one probe, in one scene of bare triangles.

Coarser than `hidden`, and much cheaper for very many objects: few rays for each, no separate scene without it (rays
pass through the object instead), and no moving of centres out of solids.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lambent.baking.probes.hidden import SHORT, spread
from lambent.baking.tracing.rays import OFFSET, cosine_directions, rays_from
from lambent.core.arrays import Floats, Indices
from lambent.scenes.mesh import Mesh, areas_of, boxes_of

RAYS = 512  # per object
CROSSINGS = 8  # of an object's own surface; rays with more crossings count as misses
AT_ONCE = 1 << 20


def widths(meshes: Sequence[Mesh]) -> Floats:
    """(N,) metres: square roots of objects' mean shadows, a quarter of their areas (Cauchy)."""
    return np.asarray(np.sqrt(areas_of(meshes) / 4))


def median_distances(meshes: Sequence[Mesh], places: Floats) -> Floats:
    """(N,) median distances in metres of the objects' centres from the viewers at `places` (m, 3)."""
    middles, step = boxes_of(meshes).mean(axis=1), max(1, AT_ONCE // len(places))
    some = (middles[first : first + step] for first in range(0, len(middles), step))
    return np.concatenate([np.median(np.linalg.norm(places - m[:, None], axis=2), axis=1) for m in some])


def hidden_shares(bare: Any, owner: Indices, meshes: Sequence[Mesh], numbers: Sequence[int]) -> Floats:
    """Share of each object's view that is hidden from its centre (N,).

    `bare` is a scene of all triangles, `owner` (F,) the object number of each; `numbers` (N,) and `meshes` are those of
    the tested objects.
    """
    per_pass, shares = AT_ONCE // RAYS, []
    for mine in (slice(first, first + per_pass) for first in range(0, len(meshes), per_pass)):
        points, normals = (np.concatenate(a) for a in zip(*(spread(m, RAYS) for m in meshes[mine]), strict=True))
        own = np.repeat(numbers[mine], RAYS)
        middles = np.repeat([np.mean(np.array(m.bounds, float), axis=0) for m in meshes[mine]], RAYS, axis=0)
        directions = cosine_directions(normals)
        above = OFFSET * (1 + np.abs(points).max(axis=1, keepdims=True))
        origins = points + normals * above
        seen = _distances(bare, owner, origins, directions, own)
        hit = np.isfinite(seen)
        offset = origins + directions * np.where(hit, seen, 0.0)[:, None] - middles
        distance = np.linalg.norm(offset, axis=1)
        free = _distances(bare, owner, middles, offset / np.maximum(distance, 1e-9)[:, None], own)
        hidden = hit & (free < distance * (1 - SHORT) - SHORT)
        lost, met = (a.reshape(-1, RAYS).sum(axis=1) for a in (hidden, hit))
        shares.append(lost / np.maximum(met, 1))
    return np.concatenate(shares) if shares else np.zeros(0)


def _distances(bare: Any, owner: Indices, origins: Floats, directions: Floats, own: Indices) -> Floats:
    """Distances (n,) to the first hits of rays that pass through the objects `own` (n,)."""
    found, start = np.full(len(origins), np.inf), np.zeros(len(origins))
    left = np.arange(len(origins))
    for _ in range(CROSSINGS):
        at = origins[left] + directions[left] * start[left, None]
        met = bare.ray_intersect_preliminary(rays_from(at, directions[left]))
        t, face = np.array(met.t).astype(float), np.array(met.prim_index).astype(np.int64)
        hit = np.isfinite(t)
        crossed = hit & (owner[np.where(hit, face, 0)] == own[left])
        found[left[hit & ~crossed]] = (start[left] + t)[hit & ~crossed]
        left, t = left[crossed], t[crossed]
        if not len(left):
            break
        start[left] += t + OFFSET * (1 + np.abs(origins[left]).max(axis=1) + t)
    return found
