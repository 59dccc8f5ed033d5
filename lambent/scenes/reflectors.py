"""Planar reflectors of a scene, which get a planar reflection buffer besides their probes (thesis M, section 4.5).

The search finds large, flat, glossy parts of objects. Coplanar parts form one reflector, regardless of objects and
materials, because one mirrored view serves all of them (the tiles of a floor, two tables of equal height). A part need
not be a whole object: the top of a table is found, its edge and its legs are not. `scene.toml` can override the search:

    [[reflectors]]
    objects = "door*"     # a pattern of object names
    use = true            # use their flat parts regardless of size and gloss; false: leave these objects out
    plane = [0, 1, 0, 0]  # optional, with use = true: the plane (n, d), n.x + d = 0
"""

from __future__ import annotations

import logging
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry.directions import basis
from lambent.core.geometry.triangles import triangle_areas, triangle_normals
from lambent.core.progress import Progress, silent, tracked
from lambent.materials.document import Material
from lambent.materials.lobes import widths
from lambent.scenes.floor_plan import FloorPlan, Surroundings, floor_plan, may_have_walls, shared_cells
from lambent.scenes.mesh import Mesh, batches_of, corners_of, vertices_at_corners
from lambent.scenes.scene import ReflectorRule, Scene, SceneObject

log = logging.getLogger(__name__)

LEAST_AREA_M2 = 0.25  # of all parts in one plane together
ROUGHEST = 0.2  # sqrt(mx my) of the narrowest lobe: a mirrored view hardly covers wider lobes
LEAST_PART_M2 = 0.02  # of one object in a plane: anything smaller is an edge that lies there by chance
FLAT_M = 1e-3  # largest distance of positions from the plane
FLAT_DEG = 2.0  # largest angle of faces, and of shading normals at their corners, from the plane's normal
MOST = 256  # largest reflectors of a scene; a frame shows a few
TRIED = 2 * MOST  # large ones after which only objects named by rules are searched; seeds are sorted by area
SEED_SHARE = 1 / 16  # share of LEAST_AREA_M2 in one histogram bin: a plane may straddle bins in all four dimensions


@dataclass(frozen=True)
class ReflectorPart:
    """The faces (K,) of one object in a reflector, and their area."""

    object: str
    faces: NDArray[np.integer]
    area_m2: float


@dataclass(frozen=True)
class Reflector:
    """A plane (n, d), n.x + d = 0, n outwards; `outline` (P, 3) is the convex hull of its parts, in the plane.

    `deviation_m` is the largest distance of its parts' vertices from the plane; `two_sided` marks a sheet visible from
    behind. `plan` is the floor plan of the walls on its edges, None without walls.
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


def find_reflectors(scene: Scene, progress: Progress = silent) -> tuple[Reflector, ...]:
    """The planar reflectors of a scene, the largest first."""
    rulings = [_ruling(scene.reflector_rules, o.name) for o in scene.objects]
    forced = {o.name for o, ruling in zip(scene.objects, rulings, strict=True) if ruling is True}
    shining = {n for n, material in scene.materials.items() if any(lobe.mirrors for lobe in material.lobes)}
    glossy = {n for n in shining if is_glossy(scene.materials[n])}
    candidates = [
        o for o, ruling in zip(scene.objects, rulings, strict=True)
        if (o.material in glossy if ruling is None else ruling and o.material in shining)
    ]  # fmt: skip
    if not candidates:
        return ()
    faces = _Faces.of(candidates)
    free = np.ones(len(faces.area), bool)
    is_forced = np.isin(faces.owner, [i for i, o in enumerate(candidates) if o.name in forced])
    found: list[tuple[Floats, Indices]] = []
    count = 0  # of those that are large, whatever their parts

    def take(plane: Floats) -> None:
        nonlocal count
        mine = faces.in_plane(plane, free)
        free[mine] = False
        found.append((plane, mine))
        count += bool(faces.area[mine].sum() >= LEAST_AREA_M2)

    for plane in _given_planes(scene.reflector_rules):
        take(plane)
    for seed in tracked(faces.seeds(is_forced), progress, "planar reflectors"):
        wanted = free[seed] and (count < TRIED or is_forced[seed])
        if wanted and len(near := faces.in_plane(faces.plane_of(seed), free)):
            take(faces.fitted(near))
    large = []
    for plane, mine in found:
        owners, part = np.unique(faces.owner[mine], return_inverse=True)
        is_large = np.bincount(part, faces.area[mine], len(owners)) > LEAST_PART_M2
        parts, mine = owners[is_large], mine[is_large[part]]
        if faces.area[mine].sum() >= LEAST_AREA_M2 or any(candidates[i].name in forced for i in parts):
            large.append(faces.reflector(plane, mine, candidates, scene.materials))
    kept = _largest(large, forced)
    return tuple(sorted(_with_walls(kept, scene), key=lambda r: -r.area_m2))


def _largest(found: list[Reflector], forced: Collection[str]) -> list[Reflector]:
    """MOST of the reflectors, those with `forced` objects and then the largest, in their order."""
    first = sorted(found, key=lambda r: (not any(part.object in forced for part in r.parts), -r.area_m2))[:MOST]
    if len(first) < len(found):
        log.warning("more than %d planar reflectors: the largest are kept, the others use probes", MOST)
    kept = set(map(id, first))
    return [r for r in found if id(r) in kept]


def _with_walls(found: Sequence[Reflector], scene: Scene) -> list[Reflector]:
    """The reflectors, those with walls on their edges with a floor plan."""
    if not found:
        return []
    around = Surroundings(scene.corners)
    meshes = {o.name: o.mesh for o in scene.objects}
    faces = [np.concatenate([meshes[part.object].corners_of(part.faces) for part in r.parts]) for r in found]
    normals = [np.array(r.plane[:3]) for r in found]
    near = [around.over(*one) for one in zip(faces, normals, strict=True)]
    walled = [i for i in range(len(found)) if may_have_walls(faces[i], normals[i], near[i])]
    cells = shared_cells([found[i].area_m2 for i in walled])
    plans = {i: floor_plan(faces[i], normals[i], near[i], n) for i, n in zip(walled, cells, strict=True)}
    return [replace(r, plan=plans.get(i)) for i, r in enumerate(found)]


def is_glossy(material: Material) -> bool:
    """Whether a lobe of the material reflects within the angle that a mirrored view covers."""
    lobes = (lobe for lobe in material.lobes if lobe.mirrors and max(lobe.k) > 0)
    return any(math.sqrt(math.prod(widths(lobe))) <= ROUGHEST for lobe in lobes)


def _ruling(rules: Iterable[ReflectorRule], name: str) -> bool | None:
    """`use` of the last rule that matches an object; None if none does."""
    uses = [rule.use for rule in rules if fnmatchcase(name, rule.objects)]
    return uses[-1] if uses else None


def _given_planes(rules: Iterable[ReflectorRule]) -> list[Floats]:
    planes = [np.asarray(rule.plane, float) for rule in rules if rule.use and rule.plane is not None]
    return [plane / np.linalg.norm(plane[:3]) for plane in planes]


@dataclass(frozen=True)
class _Faces:
    """All faces of the candidates: corners (F, 3, 3), normals (F, 3), area (F,), number of the object, and in it.

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
        meshes = [o.mesh for o in objects]
        parts = [_face_arrays(meshes[some]) for some in batches_of(meshes)]
        corners, normal, area, tilt = (np.concatenate([part[i] for part in parts]) for i in range(4))
        owner = np.repeat(np.arange(len(objects)), [len(mesh.faces) for mesh in meshes])
        number = np.concatenate([np.arange(len(mesh.faces)) for mesh in meshes])
        return _Faces(corners, normal, area, tilt, owner, number)

    def plane_of(self, face: int) -> Floats:
        n = self.normal[face]
        return np.array([*n, -n @ self.corners[face].mean(axis=0)])

    def in_plane(self, plane: Floats, free: Flags) -> Indices:
        """The faces among `free` (F,) that lie in the plane and face the side of its normal."""
        flat = np.cos(np.radians(FLAT_DEG))
        chord = 2 * np.sin(np.radians(FLAT_DEG) / 2) * 1.001
        near = np.sort(np.asarray(self._by_normal.query_ball_point(plane[:3], chord), int))
        near = near[free[near] & (self.tilt[near] > flat)]
        near = near[self.normal[near] @ plane[:3] > flat]
        within = np.abs(self.corners[near] @ plane[:3] + plane[3]).max(axis=1, initial=0) <= FLAT_M
        return np.asarray(near[within])

    @cached_property
    def _by_normal(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self.normal)

    def fitted(self, mine: Indices) -> Floats:
        """Plane of the mean normal through the mean position, weighted by area."""
        weight = self.area[mine]
        n = weight @ self.normal[mine]
        n /= np.linalg.norm(n)
        return np.array([*n, -n @ (weight @ self.corners[mine].mean(axis=1)) / weight.sum()])

    def seeds(self, forced: NDArray[np.bool_]) -> list[int]:
        """The largest face of every bin of (normal, offset) with enough area, the fullest bin first.

        Bins that cannot make a reflector even with all of their neighbours are left out, but for those with `forced`
        faces (F,): a scene may have 100,000.
        """
        offset = (self.normal * self.corners.mean(axis=1)).sum(axis=1)
        step = np.radians(FLAT_DEG)
        bins = np.concatenate([np.round(self.normal / step), np.round(offset / (8 * FLAT_M))[:, None]], axis=1)
        bins = bins.astype(np.int64)
        bins += 1 - bins.min(axis=0)
        sides = bins.max(axis=0) + 2  # an empty bin between rows
        weights = np.cumprod(np.append(1, sides[:0:-1]))[::-1]  # the offset counts least: neighbours are consecutive
        key, group = np.unique(bins @ weights, return_inverse=True)
        filled = np.bincount(group, self.area)
        largest = np.lexsort((self.area, group))[np.append(np.flatnonzero(np.diff(np.sort(group))), len(group) - 1)]
        order = np.argsort(-filled, kind="stable")
        around = np.zeros(len(key))
        up_to = np.append(0.0, np.cumsum(filled))
        for beside in product((-1, 0, 1), repeat=3):
            middle = key + np.dot(beside, weights[:3])
            low, high = np.searchsorted(key, middle - 1), np.searchsorted(key, middle + 1, side="right")
            around += up_to[high] - up_to[low]
        wanted = (filled >= SEED_SHARE * LEAST_AREA_M2) & (around >= (1 - 1e-6) * LEAST_AREA_M2)
        wanted |= np.bincount(group, forced * self.area) > 0
        return [int(largest[g]) for g in order if wanted[g]]

    def reflector(
        self, plane: Floats, mine: Indices, objects: list[SceneObject], materials: Mapping[str, Material]
    ) -> Reflector:
        parts, two_sided = [], False
        owners, counts = np.unique(self.owner[mine], return_counts=True)
        ordered = mine[np.argsort(self.owner[mine], kind="stable")]
        for i, here in zip(owners, np.split(ordered, np.cumsum(counts)[:-1]), strict=True):
            whole = len(here) == len(objects[i].mesh.faces)
            two_sided |= bool(whole or materials[objects[i].material].transmits)
            parts.append(ReflectorPart(objects[i].name, self.number[here], float(self.area[here].sum())))
        points = self.corners[mine].reshape(-1, 3)
        height = points @ plane[:3] + plane[3]
        nx, ny, nz, d = map(float, plane)
        outline = _outline(points - height[:, None] * plane[:3], plane[:3])
        return Reflector((nx, ny, nz, d), outline, float(np.abs(height).max()), two_sided, tuple(parts))


def _face_arrays(meshes: Sequence[Mesh]) -> tuple[Floats, Floats, Floats, Floats]:
    corners = corners_of(meshes)
    normal = triangle_normals(corners)
    shading = vertices_at_corners(meshes, [mesh.normals for mesh in meshes])
    return corners, normal, triangle_areas(corners), (shading * normal[:, None]).sum(axis=2).min(axis=1)


def _outline(points: Floats, normal: Floats) -> Floats:
    """Convex hull (P, 3) of points in a plane, counter-clockwise seen from its normal's side."""
    from scipy.spatial import ConvexHull, QhullError  # half a second, only for scenes with reflectors

    flat = points @ np.stack(basis(normal), axis=1)
    _, kept = np.unique(flat.round(4), axis=0, return_index=True)
    if len(kept) > 2:
        with suppress(QhullError):  # of points on one line
            hull = ConvexHull(flat[kept]).vertices
            kept = kept[np.roll(hull, -int(np.argmin(hull)))]
    return np.asarray(points[kept])
