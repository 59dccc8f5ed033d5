"""Flush surfaces: faces of two surfaces that overlap in one plane, such as a decal on a wall.

Neither rays nor a depth buffer can tell which is in front: pictures show patches of both. One is therefore raised, by
more than rays are offset and depth is rounded, and by less than is visible:

- Of faces that look the same way, the smaller surface lies on top, of equal ones that of the later object.
- Of sheets that look opposite ways, each shows on its own side; a sheet on a body lies on its outside.
- Where bodies touch, nothing shows, and nothing moves.

Surfaces of one material without reflections, textures and emission look the same whichever is in front: they stay.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lambent.core.arrays import MIXERS, Flags, Floats, Indices, components, hashes
from lambent.core.geometry.coplanar import PARALLEL, coplanar_overlaps
from lambent.core.geometry.triangles import triangle_areas, triangle_normals
from lambent.core.plain import first_of
from lambent.scenes.mesh import vertices_at_corners
from lambent.scenes.scene import Scene, SceneObject

RAISED = 5e-5  # metres, and share of the largest coordinate: five times the offset of rays (baking.tracing.rays); the
# depth of a pixel is uncertain by 3e-6 of its distance
RAISED_OF_SCENE = 2e-7  # likewise, of the scene's diagonal: twice the offset of rays
IN_PLANE = 0.4  # of that, apart: surfaces that count as flush
ALIKE = 1e-3  # relative difference of areas that count as equal
MOST_LAYERS = 8  # a long row of copies that overlap must not climb
NAMED = 4  # pairs, one more than a warning lists
SAME_WAY = 0.05  # relative eigenvalue: planes that meet at less than 25 degrees move along their mean normal


@dataclass(frozen=True)
class _Faces:
    """Faces of the objects with flush surfaces: corners (F, 3, 3), normals (F, 3) on the side of the vertices' normals.

    `owner` (F,) is the object of each, `place` (F, 3) the number of a corner's position in that object, `height` (F,)
    by how much a layer is raised, m.
    """

    corners: Floats
    normals: Floats
    owner: Indices
    place: Indices
    height: Floats

    @staticmethod
    def of(objects: list[SceneObject], owner: Indices, height: Floats) -> _Faces:
        meshes = [o.mesh for o in objects]
        corners = vertices_at_corners(meshes, [mesh.positions for mesh in meshes])
        normals = triangle_normals(corners)
        shown = vertices_at_corners(meshes, [mesh.normals for mesh in meshes]).sum(axis=1)
        normals[(normals * shown).sum(axis=1) < 0] *= -1
        at = hashes(np.round(corners.reshape(-1, 3) / (1e-3 * RAISED))) + np.repeat(owner, 3) * MIXERS[0]
        return _Faces(corners, normals, owner, np.unique(at, return_inverse=True)[1].reshape(-1, 3), height)

    def above(self, faces: Indices, others: Indices) -> Floats:
        """(n, 3) heights of the corners of `others` over the planes of `faces`, relative to what counts as flush."""
        away = self.corners[others] - self.corners[faces, :1]
        return np.asarray((away * self.normals[faces, None]).sum(axis=2) / (IN_PLANE * self.height[faces, None]))


@dataclass(frozen=True)
class _Sheets:
    """Connected faces of one object in one plane: `of` (F,) is each face's; `area`, `owner` (S,).

    `normals` (S, 3) are those of the first faces, because faces may be doubled. `body` (S,) tells whether the object
    goes on behind the sheet.
    """

    of: Indices
    area: Floats
    owner: Indices
    normals: Floats
    body: Flags


def with_flush_raised(scene: Scene) -> Scene:
    """The scene with flush surfaces raised, and a warning that names them."""
    looks = _looks(scene)
    if not looks.any():
        return scene
    owner = np.repeat(np.arange(len(looks)), [len(o.mesh.faces) for o in scene.objects])
    corners = scene.corners
    size = float(np.linalg.norm(np.ptp(corners.reshape(-1, 3), axis=0)))
    height = RAISED * (1 + np.abs(corners).max(axis=(1, 2))) + RAISED_OF_SCENE * size
    pairs = coplanar_overlaps(corners, looks[owner], IN_PLANE * height)
    if not len(pairs):
        return scene
    concerned = np.zeros(len(looks), bool)
    concerned[owner[pairs]] = True
    mine = np.flatnonzero(concerned[owner])
    faces = _Faces.of([o for o, one in zip(scene.objects, concerned, strict=True) if one], owner[mine], height[mine])
    sheets = _sheets(faces)
    upper, lower, sense = _order(faces, sheets, looks, np.searchsorted(mine, pairs))
    layer = (_layers(upper, lower, len(sense)) * sense)[sheets.of]
    layer *= np.sign((faces.normals * sheets.normals[sheets.of]).sum(axis=1)).astype(np.int64)
    return _raised(scene, faces, layer * faces.height, sheets.owner[np.stack([upper, lower], axis=1)])


def _raised(scene: Scene, faces: _Faces, height: Floats, pairs: Indices) -> Scene:
    """The scene with its faces (F,) raised by `height` (F,); `pairs` (n, 2) are objects that lie on others."""
    if not len(pairs):
        return scene
    objects, positions = list(scene.objects), faces.corners + _steps(faces, height)[faces.place]
    for i in np.unique(faces.owner[height != 0]):
        mesh, (first, end) = objects[i].mesh, np.searchsorted(faces.owner, [i, i + 1])
        moved = mesh.positions.copy()
        moved[mesh.faces] = positions[first:end]
        objects[i] = replace(objects[i], mesh=replace(mesh, positions=moved))
    unique = np.unique(pairs, axis=0)  # millions, of a stack of copies
    on = [f"{objects[a].name} on {objects[b].name}" for a, b in unique[:NAMED]]
    more = len(unique) - NAMED + 1
    named = first_of(on) if more < 2 else f"{', '.join(on[:-1])} and {more:,} more"
    count = len(np.unique(pairs[:, 0]))
    warning = (
        f"{count} flush surface{'s' * (count > 1)} ({named}): of two in one plane the smaller, or else the "
        f"later, is raised by at most {1000 * np.abs(height).max():.2g} mm"
    )
    return replace(scene, objects=tuple(objects), warnings=(*scene.warnings, warning))


def _looks(scene: Scene) -> Indices:
    """(N,) number of each object's look: equal for objects that look the same in the same place."""
    found: dict[Any, int] = {}
    rich = {*scene.textures, *scene.measured, *(name for name, material in scene.materials.items() if material.lobes)}
    looks = []
    for o in scene.objects:
        arrays = (o.mesh.positions, o.mesh.faces, o.mesh.uv) if o.material in rich else ()
        key = o.material, o.emission, hash(tuple(a.tobytes() for a in arrays))
        looks.append(found.setdefault(key, len(found)))
    return np.array(looks)


def _sheets(faces: _Faces) -> _Sheets:
    count = len(faces.owner)
    ends = np.sort(np.concatenate([faces.place[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    edge = ends[:, 0] * (faces.place.max() + 1) + ends[:, 1]
    order = np.argsort(edge, kind="stable")
    twin = np.flatnonzero(edge[order][1:] == edge[order][:-1])
    a, b = order[twin] % count, order[twin + 1] % count
    a, b = np.concatenate([a, b]), np.concatenate([b, a])
    above = faces.above(a, b)
    flat = np.abs((faces.normals[a] * faces.normals[b]).sum(axis=1)) > PARALLEL
    flat &= (np.abs(above) <= 1).all(axis=1)
    of = components(np.column_stack([a[flat], b[flat]]), count)
    body = np.bincount(of[a], ~flat & (above.sum(axis=1) < 0), of.max() + 1) > 0
    first = np.unique(of, return_index=True)[1]
    area = np.bincount(of, triangle_areas(faces.corners)).astype(float)
    return _Sheets(of, area, faces.owner[first], faces.normals[first], body)


def _order(faces: _Faces, sheets: _Sheets, looks: Indices, pairs: Indices) -> tuple[Indices, Indices, Indices]:
    """Sheets that lie on others (n,), those others (n,), and the sense (S,) in which all are raised along normals."""
    rank = _ranks(sheets, looks, sheets.of[pairs])
    swapped = rank[sheets.of[pairs[:, 0]]] < rank[sheets.of[pairs[:, 1]]]
    face, under = np.where(swapped, pairs[:, ::-1].T, pairs.T)
    upper, lower = sheets.of[face], sheets.of[under]
    same = (faces.normals[face] * faces.normals[under]).sum(axis=1) > 0
    outside = same | sheets.body[lower]  # else each sheet on its own side
    towards = np.where(outside[:, None], faces.normals[under], faces.normals[face])
    order = np.argsort(1 * outside + same, kind="stable")  # of different senses, that of faces that look the same way
    sense = np.ones(len(rank), np.int64)
    sense[upper[order]] = np.sign((towards * sheets.normals[upper]).sum(axis=1))[order]
    shows = same | ~sheets.body[upper]
    upper, lower = np.divmod(np.unique(upper[shows] * len(rank) + lower[shows]), len(rank))
    return upper, lower, sense


def _ranks(sheets: _Sheets, looks: Indices, pairs: Indices) -> Indices:
    """(S,) ranks, higher for sheets on top, of sheets that overlap in `pairs` (n, 2).

    Areas are added by look among sheets that overlap directly or by others: a rug lies on many small tiles.
    """
    count = len(sheets.area)
    kind = components(pairs, count) * (looks.max() + 1) + looks[sheets.owner]
    _, kind = np.unique(kind, return_inverse=True)
    area = np.round(np.log(np.bincount(kind, sheets.area)) / ALIKE)[kind]
    rank = np.empty(count, np.int64)
    rank[np.lexsort((sheets.owner, -area))] = np.arange(count)
    return rank


def _layers(upper: Indices, lower: Indices, count: int) -> Indices:
    """(count,) layer of each sheet: 0, or one more than the highest of those that it lies on, up to MOST_LAYERS."""
    layer, before = np.zeros(count, np.int64), np.full(count, -1)
    while (layer != before).any():
        before = layer.copy()
        np.maximum.at(layer, upper, np.minimum(layer[lower] + 1, MOST_LAYERS))
    return layer


def _steps(faces: _Faces, height: Floats) -> Floats:
    """(P, 3) moves of positions, by least squares: each face (F,) by its height along its normal, and not aside."""
    raised = np.flatnonzero(height)
    n = faces.normals[raised]
    system = np.zeros((faces.place.max() + 1, 3, 4))
    for corner in faces.place[raised].T:
        np.add.at(system, corner, n[:, :, None] * np.column_stack([n, height[raised]])[:, None])
    used = np.unique(faces.place[raised])
    steps = np.zeros((len(system), 3))
    inverse = np.linalg.pinv(system[used, :, :3], rcond=SAME_WAY, hermitian=True)
    steps[used] = (inverse @ system[used, :, 3:])[..., 0]
    return steps
