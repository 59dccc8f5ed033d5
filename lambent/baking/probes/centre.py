"""Position of an object's probe.

- As given by the scene; else
- for a flat object (floor, mirror, table top), above it on the side that viewers see, or, without viewers, on the side
  that faces the scene's centre. Half the object's length, half the free distance and EYE_HEIGHT_M bound the height. It
  is above the object's centre, or, if much of the scene that viewers see mirrored is hidden from there, above another
  point (`places_above`, `ProbeSet`); else
- at the centre of the object's bounds, moved out by the shortest way if it is within another solid.
"""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

from lambent.baking.tracing.rays import array_of, distances, rays_from
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.baking.tracing.solids import SolidTest
from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import face_directions
from lambent.core.geometry.directions import basis, normalize
from lambent.core.geometry.triangles import triangle_areas, triangle_normals
from lambent.scenes.scene import EYE_HEIGHT_M, Mesh

GRID = 5  # per side of a flat object: candidate points to place a probe above
FLAT_SHARE = 0.8  # share of an object's area with normals along one axis: a slab an eighth as thick as it is long
CONTACT_M = 1e-3  # things closer to a flat object do not limit the height of its probe
CLEARANCE_M = 0.02  # beyond the surface of a solid that a centre is moved out of
MOVES = 4
ENCLOSING_SHARE = 0.5  # of the other objects, and of the directions that see the object's own outer sides


def probe_centre(builder: SceneBuilder, name: str, without: Any, solids: SolidTest | None = None) -> Floats:
    """(3,) float64 world position; `without` is the Mitsuba scene without the object, `solids` its own, if given."""
    scene = builder.scene
    if name in scene.probe_centres:
        return np.asarray(scene.probe_centres[name], float)
    solids = solids or SolidTest(builder, without)
    return centre_of(scene.object(name).mesh, np.mean(scene.bounds, axis=0), solids, without)


def centre_of(mesh: Mesh, middle: Floats, solids: SolidTest, without: Any) -> Floats:
    """The centre for a mesh, or a part of one, in a scene with centre `middle`; `solids` are those of `without`."""
    return _centre(mesh.positions, flat_axis(mesh), middle, solids, without)


def centre_among(points: Floats, normals: Floats, middle: Floats, solids: SolidTest | None, without: Any) -> Floats:
    """The centre for points (n, 3) all over a surface of unit normals (n, 3); without `solids`, never moved out."""
    return _centre(points, _axis_of(normals, np.full(len(points), 1 / len(points))), middle, solids, without)


def _centre(points: Floats, axis: Floats | None, middle: Floats, solids: SolidTest | None, without: Any) -> Floats:
    centre = _middle(points)
    if axis is not None:
        return _above(points, centre, _facing(axis, middle - centre), without)
    return centre if solids is None else _moved_out(centre, solids, without)


def outside(mesh: Mesh, middle: Floats, ways: Floats, whole: Any) -> Floats:
    """Approximate position of a mesh's probe, from the whole scene; `middle` and `ways` as for `places_above`."""
    axis = flat_axis(mesh)
    centre = _middle(mesh.positions)
    return centre if axis is None else _above(mesh.positions, centre, _seen_side(axis, centre, middle, ways), whole)


def _middle(points: Floats) -> Floats:
    return np.asarray((points.min(axis=0).astype(float) + points.max(axis=0)) / 2)


def flat_axis(mesh: Mesh) -> Floats | None:
    """Unit normal of a flat object; None for others."""
    corners = mesh.corners
    area = triangle_areas(corners)
    if area.sum() <= 0:
        return None
    return _axis_of(triangle_normals(corners), area / area.sum())


def _axis_of(n: Floats, weights: Floats) -> Floats | None:
    """Unit axis of most of the normals (k, 3), weighted by (k,); None if there is none."""
    values, vectors = np.linalg.eigh(n.T @ (weights[:, None] * n))
    return np.asarray(vectors[:, 2]) if values[2] > FLAT_SHARE else None


def _facing(axis: Floats, way: Floats) -> Floats:
    return axis if axis @ way >= 0 else -axis


def _seen_side(axis: Floats, centre: Floats, middle: Floats, ways: Floats) -> Floats:
    """The axis on the side of most `ways` (n, 3); without any, towards the `middle`."""
    return _facing(axis, axis * np.sign(ways @ axis).sum() if len(ways) else middle - centre)


def _above(points: Floats, centre: Floats, axis: Floats, without: Any) -> Floats:
    top = centre + axis * ((points - centre) @ axis).max()
    size = float(np.ptp(points, axis=0).max())
    free = float(distances(without, rays_from(top + axis * CONTACT_M, axis[None]))[0])
    return np.asarray(top + axis * min(EYE_HEIGHT_M, size / 2, free / 2))


def places_above(mesh: Mesh, middle: Floats, ways: Floats, without: Any) -> Floats:
    """(n, 3) candidate positions of a flat object's probe: above its centre, then above points all over it.

    All are on the side of most `ways` (n, 3), rays that viewers see mirrored; without any, on that of the scene's
    centre, `middle`.
    """
    axis, centre = flat_axis(mesh), _middle(mesh.positions)
    if axis is None:
        return np.asarray(centre[None])
    axis = _seen_side(axis, centre, middle, ways)
    steps = (np.arange(GRID) + 0.5) / GRID
    across = np.stack([aside.reshape(3) for aside in basis(axis[None])], axis=1)
    flat = mesh.positions @ across
    at = flat.min(axis=0) + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) * np.ptp(flat, axis=0)
    over = at @ across.T + axis * (axis @ centre)
    return np.stack([_above(mesh.positions, place, axis, without) for place in (centre, *over)])


def _moved_out(centre: Floats, solids: SolidTest, without: Any) -> Floats:
    directions = normalize(face_directions(5).reshape(-1, 3))
    for _ in range(MOVES):
        up = np.array([[0.0, 1.0, 0.0]])
        both = solids.embedded(np.stack([centre, centre]), np.concatenate([up, -up]))
        if not both.all():
            break
        t = distances(without, rays_from(centre, directions))
        centre = centre + directions[np.argmin(t)] * (t.min() + CLEARANCE_M)
    return centre


def encloses(builder: SceneBuilder, name: str, centre: Floats, whole: Any) -> bool:
    """Whether the object surrounds its probe and most of the scene, like a one-mesh room: its probe keeps it."""
    low, high = builder.scene.object(name).mesh.bounds
    others = [np.mean(o.mesh.bounds, axis=0) for o in builder.scene.objects if o.name != name]
    within = [bool(((middle > low) & (middle < high)).all()) for middle in others]
    if not others or np.mean(within) < ENCLOSING_SHARE:
        return False
    w = normalize(face_directions(8).reshape(-1, 3))
    si = whole.ray_intersect(rays_from(centre, w), mi.RayFlags.Minimal, True)
    facing = (array_of(si.n) * w).sum(axis=1) < 0
    met = builder.numbers.at(si, si.is_valid())
    own = np.array(si.is_valid() & (met == list(builder.meshes).index(name)))
    return bool((facing & own).mean() > ENCLOSING_SHARE)
