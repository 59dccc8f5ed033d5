"""What viewers see of a scene: rays in all directions from its cameras and from free places in their view.

Rays measure how much is seen of large parts. Parts that few rays hit are tested in reverse: from points on them towards
the viewers.
"""

from __future__ import annotations

import logging
from typing import Any

import numpy as np

from lambent.baking.surfaces.atlas import areas_of, even, scales_of
from lambent.baking.surfaces.charts import Piece
from lambent.baking.surfaces.density import Views, coarse_objects, sizes_seen
from lambent.baking.surfaces.visible_triangles import TriangleVisibility
from lambent.baking.tracing.rays import towards
from lambent.baking.tracing.seen.viewers import RAYS
from lambent.core.arrays import Floats, Indices
from lambent.core.geometry.triangles import points_on_triangles, triangle_areas, triangle_normals

log = logging.getLogger(__name__)

FEW = 64  # parts hit by fewer rays are tested in reverse
LOOKS, LEAST_LOOKS = 256, 16  # reverse looks per part, and for very many parts...
MOST_LOOKS = 1 << 22  # ...when the total would exceed this
NEAREST = 0.1  # share of the viewing distance: anything closer is behind viewers, like the wall a camera stands against


def texel_sizes(sight: TriangleVisibility, pieces: list[Piece], texels: int) -> Floats:
    """Texel size of each piece in metres (N,); equal if the scene has no cameras, or they see nothing.

    Objects whose texels are far larger than viewers need are logged as warnings.
    """
    scene, viewers = sight.scene, sight.viewers
    if viewers is None:
        return even(scene, pieces, texels)
    eyes, nearest = viewers.eyes, NEAREST * viewers.reach_m
    _, face, distance = sight.met
    face, distance = face[distance > nearest], distance[distance > nearest]
    if not len(face):
        return even(scene, pieces, texels)
    first = np.cumsum([0] + [len(o.mesh.faces) for o in scene.objects])
    faces = [first[piece.owner] + piece.faces for piece in pieces]
    piece_of = np.zeros(first[-1], np.int64)
    piece_of[np.concatenate(faces)] = np.repeat(np.arange(len(pieces)), [len(mine) for mine in faces])
    areas = areas_of(scene, pieces)
    part = piece_of[face]
    hits = np.bincount(part, minlength=len(pieces))
    weight = np.bincount(part, 1 / distance, len(pieces)) / RAYS / np.maximum(areas, 1e-30)
    share = hits / len(face)
    rare = np.flatnonzero(hits < FEW)
    weight[rare], solid_angle = _looked_back(sight.traced, scene.corners, [faces[i] for i in rare], eyes, nearest)
    share[rare] = areas[rare] * solid_angle * RAYS / len(face)
    sizes = sizes_seen(areas, scales_of(scene, pieces), Views(weight, share), texels)
    owner = np.array([piece.owner for piece in pieces])[part]
    for warning in coarse_objects(scene, owner, sizes[part], distance):
        log.warning(warning)
    return sizes


def seen_from_behind(sight: TriangleVisibility, least: float) -> list[str]:
    """Sorted names of opaque objects whose backs take more than the share `least` of all that viewers see."""
    if sight.viewers is None:
        return []
    ray, face, _ = sight.met
    objects = sight.scene.objects
    seen, which = np.unique(face, return_inverse=True)
    normals = triangle_normals(sight.scene.corners[seen])[which.reshape(-1)]
    counts = np.bincount(sight.owner[face[(normals * ray).sum(axis=1) > 0]], minlength=len(objects))
    return sorted(objects[number].name for number in np.flatnonzero(counts > least * len(face)))


def _looked_back(
    traced: Any, triangles: Floats, surfaces: list[Indices], eyes: Floats, nearest: float
) -> tuple[Floats, Floats]:
    """Means over surfaces and eyes of |cos| / (4 pi d^3) and |cos| / (4 pi d^2), 0 if hidden: (N,).

    `surfaces` are indices (K,) into the `triangles` (F, 3, 3).
    """
    if not surfaces:
        return np.zeros(0), np.zeros(0)
    rng = np.random.default_rng(0)
    looks = max(LEAST_LOOKS, min(LOOKS, MOST_LOOKS // len(surfaces)))
    corners = triangles[np.concatenate(surfaces)]
    number = np.repeat(np.arange(len(surfaces)), [len(surface) for surface in surfaces])
    sums = np.cumsum(np.append(0.0, triangle_areas(corners)))
    first = np.searchsorted(number, np.arange(len(surfaces) + 1))
    low, high = sums[first[:-1], None], sums[first[1:], None]
    target = low + rng.random((len(surfaces), looks)) * (high - low)
    face = np.searchsorted(sums, target.ravel(), side="right") - 1
    face = face.clip(np.repeat(first[:-1], looks), np.repeat(first[1:] - 1, looks))
    points, normals = points_on_triangles(corners, face, rng), triangle_normals(corners)[face]
    eye = eyes[rng.integers(len(eyes), size=len(face))]
    offset = eye - points
    distance = np.linalg.norm(offset, axis=1)
    distance = np.maximum(distance, 1e-9)
    cosine = (offset * normals).sum(axis=1) / distance
    normals *= np.where(cosine < 0, -1.0, 1.0)[:, None]
    ray = towards(traced, *(values.astype(np.float32) for values in (points, normals, eye)))
    hidden = np.array(traced.ray_test(ray)) | (distance <= nearest)
    seen = np.where(hidden, 0.0, np.abs(cosine).clip(0, 1)) / (4 * np.pi)
    by_cube, by_square = ((seen / distance**power).reshape(-1, looks).mean(axis=1) for power in (3, 2))
    return by_cube, by_square
