"""What viewers see of a scene: rays in all directions from its cameras and from free places in their view.

Rays measure how much is seen of large parts. Parts that few rays hit are tested in reverse: from points on them towards
the viewers.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

import numpy as np

from lambent.bake.surfaces.atlas import areas_of, even, scales_of
from lambent.bake.surfaces.charts import Piece
from lambent.bake.surfaces.density import Views, coarse_objects, sizes_seen
from lambent.bake.tracing.rays import rays_from, towards
from lambent.bake.tracing.scene_builder import bare_scene
from lambent.bake.tracing.visibility import viewing_places
from lambent.core.arrays import Floats, Indices
from lambent.core.geometry import points_on_triangles, triangle_areas, triangle_normals
from lambent.scenes.scene import Scene

log = logging.getLogger(__name__)

RAYS = 1 << 18
FEW = 64  # parts hit by fewer rays are tested in reverse
LOOKS, LEAST_LOOKS = 256, 16  # reverse looks per part, and for very many parts...
MOST_LOOKS = 1 << 22  # ...when the total would exceed this
NEAREST = 0.1  # share of the viewing distance: anything closer is behind viewers, like the wall a camera stands against


@dataclass(frozen=True)
class Viewers:
    """Eyes (E, 3) of a scene's viewers, and their reach: nine tenths of their looks end within `reach_m`."""

    eyes: Floats
    reach_m: float


def viewers_of(scene: Scene, traced: Any = None) -> Viewers | None:
    """Eyes at the cameras and at free places in their view, half each; None without cameras, or if they see nothing.

    Places beyond the cameras' reach are left out, because rays through a window end far outside. `traced` is the scene
    of opaque triangles, if already built.
    """
    cameras = [*scene.cameras, *(key for path in scene.paths for key in path.keys)]
    opaque = _opaque(scene)
    if not cameras or not len(opaque):
        return None
    eyes = np.array([camera.position for camera in cameras], float)
    traced = traced or bare_scene(scene.corners[opaque])
    _, distance = _seen(traced, eyes, RAYS // 16)
    if not len(distance):
        return None
    reach = float(np.quantile(distance, 0.9))
    places = viewing_places(scene, traced)
    places = places[np.linalg.norm(places[:, None] - eyes, axis=2).min(axis=1) < reach]
    return Viewers(np.concatenate([np.resize(eyes, (max(len(places), len(eyes)), 3)), places]), reach)


def texel_sizes(scene: Scene, pieces: list[Piece], texels: int) -> Floats:
    """Texel size of each piece in metres (N,); equal if the scene has no cameras, or they see nothing.

    Objects whose texels are far larger than viewers need are logged as warnings.
    """
    corners, opaque = scene.corners, _opaque(scene)
    traced = bare_scene(corners[opaque]) if len(opaque) else None
    viewers = viewers_of(scene, traced)
    if viewers is None:
        return even(scene, pieces, texels)
    eyes, nearest = viewers.eyes, NEAREST * viewers.reach_m
    first = np.cumsum([0] + [len(o.mesh.faces) for o in scene.objects])
    faces = [first[piece.owner] + piece.faces for piece in pieces]
    piece_of = np.zeros(first[-1], np.int64)
    for number, mine in enumerate(faces):
        piece_of[mine] = number
    face, distance = _seen(traced, eyes, RAYS)
    face, distance = face[distance > nearest], distance[distance > nearest]
    if not len(face):
        return even(scene, pieces, texels)
    areas = areas_of(scene, pieces)
    part = piece_of[opaque[face]]
    hits = np.bincount(part, minlength=len(pieces))
    weight = np.bincount(part, 1 / distance, len(pieces)) / RAYS / np.maximum(areas, 1e-30)
    share = hits / len(face)
    rare = np.flatnonzero(hits < FEW)
    weight[rare], solid_angle = _looked_back(traced, [corners[faces[i]] for i in rare], eyes, nearest)
    share[rare] = areas[rare] * solid_angle * RAYS / len(face)
    sizes = sizes_seen(areas, scales_of(scene, pieces), Views(weight, share), texels)
    owner = np.array([piece.owner for piece in pieces])[part]
    for warning in coarse_objects(scene, owner, sizes[part], distance):
        log.warning(warning)
    return sizes


def seen_from_behind(scene: Scene, least: float) -> list[str]:
    """Sorted names of opaque objects whose backs take more than the share `least` of all that viewers see."""
    opaque = _opaque(scene)
    corners = scene.corners[opaque]
    traced = bare_scene(corners) if len(opaque) else None
    viewers = viewers_of(scene, traced)
    if viewers is None:
        return []
    ray, face, _ = _met(traced, viewers.eyes, RAYS)
    behind = (triangle_normals(corners[face]) * ray).sum(axis=1) > 0
    owner = np.repeat(np.arange(len(scene.objects)), [len(o.mesh.faces) for o in scene.objects])[opaque]
    counts = np.bincount(owner[face[behind]], minlength=len(scene.objects))
    return sorted(scene.objects[number].name for number in np.flatnonzero(counts > least * len(face)))


def _opaque(scene: Scene) -> Indices:
    """Numbers of all opaque triangles."""
    clear = [scene.materials[o.material].transmits or _has_holes(scene, o.material) for o in scene.objects]
    return np.flatnonzero(~np.repeat(clear, [len(o.mesh.faces) for o in scene.objects]))


def _has_holes(scene: Scene, material: str) -> bool:
    textures = scene.textures.get(material)
    return textures is not None and textures.opacity is not None


def _seen(traced: Any, eyes: Floats, count: int) -> tuple[Indices, Floats]:
    """Triangles (M,) hit by `count` rays from the eyes, and their distances (M,)."""
    return _met(traced, eyes, count)[1:]


def _met(traced: Any, eyes: Floats, count: int) -> tuple[Floats, Indices, Floats]:
    """Of `count` rays from the eyes, those that hit: directions (M, 3), triangles (M,), distances (M,)."""
    rng = np.random.default_rng(0)
    z, phi = 1 - 2 * rng.random(count), 2 * np.pi * rng.random(count)
    directions = np.stack([np.sqrt(1 - z**2) * np.cos(phi), z, np.sqrt(1 - z**2) * np.sin(phi)], axis=-1)
    met = traced.ray_intersect_preliminary(rays_from(eyes[np.arange(count) % len(eyes)], directions))
    hit = np.flatnonzero(np.array(met.is_valid()))
    return directions[hit], np.array(met.prim_index)[hit].astype(np.int64), np.array(met.t)[hit].astype(float)


def _looked_back(traced: Any, surfaces: list[Floats], eyes: Floats, nearest: float) -> tuple[Floats, Floats]:
    """Means over surfaces (F, 3, 3) and eyes of |cos| / (4 pi d^3) and |cos| / (4 pi d^2), 0 if hidden: (N,)."""
    if not surfaces:
        return np.zeros(0), np.zeros(0)
    rng = np.random.default_rng(0)
    looks = max(LEAST_LOOKS, min(LOOKS, MOST_LOOKS // len(surfaces)))
    corners = np.concatenate(surfaces)
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
