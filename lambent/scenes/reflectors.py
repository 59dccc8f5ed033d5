"""Planar reflectors of a scene: where a mirror rendering shows more than a probe can (thesis M, section 4.5).

Found are the large, flat, glossy parts of objects. Parts that share a plane are one reflector, whatever objects and
materials they belong to: one mirror rendering serves them all (the tiles of a floor, two tables of one height). Parts
need not be whole objects: the top of a table is found, its edge and its legs are not. `scene.toml` has the last word:

    [[reflectors]]
    objects = "door*"     # a pattern of object names
    use = true            # flat parts of these count whatever their size and gloss; false: they never count
    plane = [0, 1, 0, 0]  # optional, with use = true: (n, d), n.x + d = 0, in place of what would be found
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import NDArray

from lambent.core.directions import basis
from lambent.materials.document import Lobe, Material
from lambent.scenes.floor_plan import FloorPlan, floor_plan
from lambent.scenes.geometry import areas
from lambent.scenes.scene import Mesh, ReflectorRule, Scene, SceneObject

Floats = NDArray[np.floating]
LEAST_AREA_M2 = 0.25  # of all parts in one plane
ROUGHEST = 0.2  # sqrt(mx my) of the narrowest lobe: the mirror view holds what such a lobe sees, and hardly more
LEAST_PART_M2 = 0.02  # of one object in a plane: less is an edge that happens to lie there
FLAT_M = 1e-3  # from the plane, for positions
FLAT_DEG = 2.0  # from the plane's normal, for faces and for the shading normals at their corners
SEED_SHARE = 1 / 16  # of LEAST_AREA_M2 in one bin of the histogram: a plane may straddle bins in all four directions


@dataclass(frozen=True)
class ReflectorPart:
    """What one object has of a reflector: the numbers (K,) of its faces, and their area."""

    object: str
    faces: NDArray[np.integer]
    area_m2: float


@dataclass(frozen=True)
class Reflector:
    """A plane (n, d), n.x + d = 0, n outwards; `outline` (P, 3) is the convex hull of its parts, in the plane.

    `deviation_m` is the largest distance of a vertex of its parts from the plane; `two_sided` is whether it is a sheet
    that may be seen from behind, too. `plan` says where walls stand on the edges of its parts; None where
    none does.
    """

    plane: tuple[float, float, float, float]
    outline: Floats
    deviation_m: float
    two_sided: bool
    parts: tuple[ReflectorPart, ...]
    plan: FloorPlan | None = None

    @property
    def area_m2(self) -> float:
        return sum(part.area_m2 for part in self.parts)


def find_reflectors(scene: Scene) -> tuple[Reflector, ...]:
    """The planar reflectors of a scene, the largest first."""
    forced = {o.name for o in scene.objects if _ruling(scene.reflector_rules, o.name) is True}
    candidates = [o for o in scene.objects if _is_candidate(scene, o)]
    if not candidates:
        return ()
    faces = _Faces.of(candidates)
    free = np.ones(len(faces.area), bool)
    found = []
    for plane in _given_planes(scene.reflector_rules):
        mine = faces.in_plane(plane) & free
        free &= ~mine
        found.append((plane, mine))
    for seed in faces.seeds(np.isin(faces.owner, [i for i, o in enumerate(candidates) if o.name in forced])):
        if not free[seed]:
            continue
        near = faces.in_plane(faces.plane_of(seed)) & free
        if near.any():
            plane = faces.fitted(near)
            mine = faces.in_plane(plane) & free
            free &= ~mine
            found.append((plane, mine))
    large = []
    for plane, mine in found:
        parts = [i for i in np.unique(faces.owner[mine]) if faces.area[mine & (faces.owner == i)].sum() > LEAST_PART_M2]
        mine &= np.isin(faces.owner, parts)
        if faces.area[mine].sum() >= LEAST_AREA_M2 or any(candidates[i].name in forced for i in parts):
            large.append(faces.reflector(plane, mine, candidates, scene.materials))
    corners = scene.corners
    meshes = {o.name: o.mesh for o in candidates}
    return tuple(sorted((_with_walls(r, meshes, corners) for r in large), key=lambda r: -r.area_m2))


def _with_walls(found: Reflector, meshes: Mapping[str, Mesh], corners: Floats) -> Reflector:
    """The reflector with what stands on its edges; `corners` (F, 3, 3) are the triangles of the scene."""
    n = np.array(found.plane[:3])
    parts = ((meshes[part.object], part.faces) for part in found.parts)
    faces = np.concatenate([mesh.positions[mesh.faces[numbers]] for mesh, numbers in parts]).astype(float)
    return replace(found, plan=floor_plan(faces, n, corners))


def is_glossy(material: Material) -> bool:
    """Whether a lobe of the material reflects within an angle that a mirror rendering can stand for."""
    return any(_roughness(lobe) <= ROUGHEST for lobe in material.lobes if lobe.side == "reflection" and max(lobe.k) > 0)


def _roughness(lobe: Lobe) -> float:
    return float(np.sqrt(lobe.mx * lobe.my))


def _ruling(rules: Iterable[ReflectorRule], name: str) -> bool | None:
    """What the last rule that fits an object says; None where none does."""
    said = [rule.use for rule in rules if fnmatchcase(name, rule.objects)]
    return said[-1] if said else None


def _is_candidate(scene: Scene, o: SceneObject) -> bool:
    ruling = _ruling(scene.reflector_rules, o.name)
    shines = any(lobe.side == "reflection" for lobe in scene.materials[o.material].lobes)
    return shines and (is_glossy(scene.materials[o.material]) if ruling is None else ruling)


def _given_planes(rules: Iterable[ReflectorRule]) -> list[Floats]:
    planes = [np.asarray(rule.plane, float) for rule in rules if rule.use and rule.plane is not None]
    return [plane / np.linalg.norm(plane[:3]) for plane in planes]


@dataclass(frozen=True)
class _Faces:
    """All faces of the candidates: corners (F, 3, 3), normals (F, 3), area (F,), the object's and their own number.

    `tilt` (F,) is the least cosine between the shading normals at the corners and the face's.
    """

    corners: Floats
    normal: Floats
    area: Floats
    tilt: Floats
    owner: NDArray[np.integer]
    number: NDArray[np.integer]

    @staticmethod
    def of(objects: list[SceneObject]) -> _Faces:
        parts = [_face_arrays(o.mesh) for o in objects]
        corners, normal, area, tilt = (np.concatenate([part[i] for part in parts]) for i in range(4))
        owner = np.repeat(np.arange(len(objects)), [len(o.mesh.faces) for o in objects])
        number = np.concatenate([np.arange(len(o.mesh.faces)) for o in objects])
        return _Faces(corners, normal, area, tilt, owner, number)

    def plane_of(self, face: int) -> Floats:
        n = self.normal[face]
        return np.array([*n, -n @ self.corners[face].mean(axis=0)])

    def in_plane(self, plane: Floats) -> NDArray[np.bool_]:
        """(F,) whether a face lies in the plane and faces its side."""
        flat = np.cos(np.radians(FLAT_DEG))
        inside = (self.normal @ plane[:3] > flat) & (self.tilt > flat)
        inside[inside] = np.abs(self.corners[inside] @ plane[:3] + plane[3]).max(axis=1) <= FLAT_M
        return inside

    def fitted(self, mine: NDArray[np.bool_]) -> Floats:
        """Plane of the mean normal through the mean place, by area."""
        weight = self.area[mine]
        n = weight @ self.normal[mine]
        n /= np.linalg.norm(n)
        return np.array([*n, -n @ (weight @ self.corners[mine].mean(axis=1)) / weight.sum()])

    def seeds(self, forced: NDArray[np.bool_]) -> list[int]:
        """The largest face of every bin of (normal, offset) that holds enough area, the fullest bin first."""
        offset = (self.normal * self.corners.mean(axis=1)).sum(axis=1)
        step = np.radians(FLAT_DEG)
        key = np.concatenate([np.round(self.normal / step), np.round(offset / (8 * FLAT_M))[:, None]], axis=1)
        _, group = np.unique(key.astype(np.int64), axis=0, return_inverse=True)
        group = group.reshape(-1)
        filled = np.bincount(group, self.area)
        largest = np.lexsort((self.area, group))[np.append(np.flatnonzero(np.diff(np.sort(group))), len(group) - 1)]
        order = np.argsort(-filled, kind="stable")
        wanted = (filled >= SEED_SHARE * LEAST_AREA_M2) | (np.bincount(group, forced * self.area) > 0)
        return [int(largest[g]) for g in order if wanted[g]]

    def reflector(
        self, plane: Floats, mine: NDArray[np.bool_], objects: list[SceneObject], materials: Mapping[str, Material]
    ) -> Reflector:
        parts, two_sided = [], False
        for i in np.unique(self.owner[mine]):
            here = mine & (self.owner == i)
            whole = here.sum() == len(objects[i].mesh.faces)
            two_sided |= bool(whole or materials[objects[i].material].transmits)
            parts.append(ReflectorPart(objects[i].name, self.number[here], float(self.area[here].sum())))
        points = self.corners[mine].reshape(-1, 3)
        height = points @ plane[:3] + plane[3]
        nx, ny, nz, d = map(float, plane)
        outline = _outline(points - height[:, None] * plane[:3], plane[:3])
        return Reflector((nx, ny, nz, d), outline, float(np.abs(height).max()), two_sided, tuple(parts))


def _face_arrays(mesh: Mesh) -> tuple[Floats, Floats, Floats, Floats]:
    corners = mesh.positions[mesh.faces].astype(float)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    normal = np.divide(cross, length, out=np.zeros_like(cross), where=length > 0)
    tilt = (mesh.normals[mesh.faces] * normal[:, None]).sum(axis=2).min(axis=1)
    return corners, normal, areas(mesh.positions, mesh.faces), tilt


def _outline(points: Floats, normal: Floats) -> Floats:
    """Convex hull (P, 3) of points in a plane, counter-clockwise seen from its normal's side (Andrew 1979)."""
    t, b = (axis.reshape(3) for axis in basis(normal[None]))
    flat = points @ np.stack([t, b], axis=1)
    _, first = np.unique(flat.round(4), axis=0, return_index=True)  # sorted by t, then b
    if len(first) < 3:
        return points[first]

    def chain(order: NDArray[np.integer]) -> list[int]:
        hull: list[int] = []
        for i in order:
            while len(hull) > 1 and _turn(flat[hull[-2]], flat[hull[-1]], flat[i]) <= 0:
                hull.pop()
            hull.append(int(i))
        return hull[:-1]

    return points[[*chain(first), *chain(first[::-1])]]


def _turn(a: Floats, b: Floats, c: Floats) -> float:
    (ux, uy), (vx, vy) = b - a, c - a
    return float(ux * vy - uy * vx)
