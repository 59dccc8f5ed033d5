"""Hard edges: smooth normals across them deviate far from the faces', and shade a box like a ball."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lambent.core.arrays import Floats, Indices, hashes
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.triangles import area_vectors, corner_angles, triangle_normals
from lambent.scenes.geometry import tangents_along
from lambent.scenes.mesh import Mesh, batches_of, corners_of, vertices_at_corners
from lambent.scenes.scene import SceneObject

DEVIATION_DEG = 40.0  # of a normal from its face's, above which it is reported; a smooth prism of 10 sides has 18
DEVIATION_SHARE = 0.2  # of an object's area: the normals of fillets deviate, and are meant to
NAMED = 2
MEETING = 256  # faces in one place, of which normals are the mean
CORNERS_AT_ONCE = 1 << 20


def deviating_faces(meshes: Sequence[Mesh]) -> Indices:
    """(N,) triangles of each mesh with a normal more than DEVIATION_DEG from the face's.

    0 where they are less than DEVIATION_SHARE of the mesh's area.
    """
    found = [np.zeros(0, np.int64)]
    for mine in batches_of(meshes):
        some = meshes[mine]
        owner = np.repeat(np.arange(len(some)), [len(mesh.faces) for mesh in some])
        vectors = area_vectors(corners_of(some))
        faces, areas = normalize(vectors), np.linalg.norm(vectors, axis=-1) / 2
        normals = vertices_at_corners(some, [mesh.normals for mesh in some])
        cosine = np.abs((normals * faces[:, None]).sum(axis=2)).min(axis=1)
        deviates = (cosine < np.cos(np.radians(DEVIATION_DEG))) & (areas > 0)
        area_m2, least_m2 = (np.bincount(owner, areas * w, len(some)) for w in (deviates, DEVIATION_SHARE))
        found.append(np.where(area_m2 > least_m2, np.bincount(owner[deviates], minlength=len(some)), 0))
    return np.concatenate(found)


def deviation_warnings(objects: Sequence[SceneObject]) -> list[str]:
    """One warning for all objects with `deviating_faces`, or none."""
    found = deviating_faces([o.mesh for o in objects])
    counts = {objects[i].name: int(found[i]) for i in np.flatnonzero(found).tolist()}
    if not counts:
        return []
    names = ", ".join([*list(counts)[:NAMED], *(["..."] if len(counts) > NAMED else [])])
    return [
        f"{sum(counts.values())} triangles of {len(counts)} objects ({names}) have normals over {DEVIATION_DEG:.0f} "
        f"degrees from the face, as on boxes with smooth normals: a crease angle of {DEVIATION_DEG:.0f} makes them "
        "hard (--crease-angle, crease_angle in a scene.toml)"
    ]


def creased(mesh: Mesh, angle_deg: float) -> Mesh:
    """The mesh with new normals: smooth where faces meet at less than an angle, hard elsewhere.

    A corner's normal is the mean of the faces that meet there within the angle of its own, weighted by their angles
    there, so that it does not matter how quads are divided. Vertices are split if their corners get different normals.
    """
    faces = triangle_normals(mesh.corners)
    faces[(faces * mesh.normals[mesh.faces].sum(axis=1)).sum(axis=1) < 0] *= -1  # against the winding, as in the file
    at = hashes(mesh.positions[mesh.faces].reshape(-1, 3))
    _, place = np.unique(at, return_inverse=True)
    vectors = (faces[:, None] * corner_angles(mesh.corners)[..., None]).reshape(-1, 3)
    normals = normalize(_sums_within(vectors, faces, place, angle_deg))
    lost = np.flatnonzero((normals == 0).all(axis=1))
    normals[lost] = faces[lost // 3]
    uv = mesh.uv[mesh.faces].reshape(-1, 2)
    _, kept, index = np.unique(
        at + 3 * hashes(uv) + 5 * hashes(normals.round(5)), return_index=True, return_inverse=True
    )
    copied = mesh.at_vertices(mesh.faces.reshape(-1)[kept], index.reshape(-1, 3).astype(np.uint32))
    new: Floats = normals[kept]
    tangents = tangents_along(new, copied.tangents.astype(float))
    return replace(copied, normals=new.astype(np.float32), tangents=tangents.astype(np.float32))


def _sums_within(vectors: Floats, faces: Floats, place: Indices, angle_deg: float) -> Floats:
    """(3 F, 3) sums by corner of vectors (3 F, 3) of corners in its place (3 F,), of faces within the angle of its own.

    `faces` (F, 3) are unit normals. Where very many meet, as at the apex of a cone, some of them count.
    """
    order, count = np.argsort(place, kind="stable"), np.bincount(place)
    first, met = np.cumsum(count) - count, np.minimum(count, MEETING)[place]
    total, ends = np.zeros((len(place), 3)), np.cumsum(met)
    start = 0
    while start < len(place):
        before = ends[start] - met[start]
        stop = max(start + 1, int(np.searchsorted(ends, before + CORNERS_AT_ONCE)))
        own = np.repeat(np.arange(start, stop), met[start:stop])
        turn = np.arange(len(own)) + before - (ends - met)[own]
        other = order[first[place[own]] + turn * count[place[own]] // met[own]]
        near = (faces[own // 3] * faces[other // 3]).sum(axis=1) >= np.cos(np.radians(angle_deg)) - 1e-6
        near |= own == other
        for axis in range(3):
            total[start:stop, axis] = np.bincount(own[near] - start, vectors[other[near], axis], stop - start)
        start = stop
    return total


def with_creases(objects: Sequence[SceneObject], angle_deg: float) -> tuple[SceneObject, ...]:
    """The objects, those with `deviating_faces` creased."""
    counts = deviating_faces([o.mesh for o in objects])
    return tuple(replace(o, mesh=creased(o.mesh, angle_deg)) if n else o for o, n in zip(objects, counts, strict=True))
