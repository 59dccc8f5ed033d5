"""Hard edges: smooth normals across them deviate far from the faces', and shade a box like a ball."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.triangles import area_vectors, triangle_normals
from lambent.scenes.geometry import tangents_along
from lambent.scenes.mesh import Mesh, batches_of, corners_of, vertices_at_corners
from lambent.scenes.scene import SceneObject

DEVIATION_DEG = 40.0  # of a normal from its face's, above which it is reported; a smooth prism of 10 sides has 18
DEVIATION_SHARE = 0.2  # of an object's area: the normals of fillets deviate, and are meant to
NAMED = 2


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

    A corner's normal is the area-weighted mean of the faces that meet there within the angle of its own face. Vertices
    are split if their corners get different normals.
    """
    corners = mesh.corners.astype(float)
    vectors, faces = area_vectors(corners), triangle_normals(corners)
    turned = (faces * mesh.normals[mesh.faces].sum(axis=1)).sum(axis=1) < 0  # against the winding, as in the file
    vectors[turned], faces[turned] = -vectors[turned], -faces[turned]
    _, place = np.unique(mesh.positions, axis=0, return_inverse=True)
    place = place.reshape(-1)[mesh.faces.reshape(-1)]  # by corner
    order = np.argsort(place, kind="stable")
    count = np.bincount(place)
    first = np.cumsum(count) - count
    own = np.repeat(order, count[place[order]])  # pairs of corners at one place
    step = np.arange(len(own)) - np.repeat(np.cumsum(count[place[order]]) - count[place[order]], count[place[order]])
    other = order[first[place[own]] + step]
    near = (faces[own // 3] * faces[other // 3]).sum(axis=1) >= np.cos(np.radians(angle_deg)) - 1e-6
    near |= own == other
    sums = [np.bincount(own[near], vectors[other[near] // 3, axis], len(place)) for axis in range(3)]
    total = np.stack(sums, axis=1).astype(float)
    normals = normalize(total)
    normals[(normals == 0).all(axis=1)] = faces[np.flatnonzero((normals == 0).all(axis=1)) // 3]
    vertex = mesh.faces.reshape(-1).astype(float)
    _, kept, index = np.unique(
        np.column_stack([vertex, normals.round(5)]), axis=0, return_index=True, return_inverse=True
    )
    copied = mesh.at_vertices(mesh.faces.reshape(-1)[kept], index.reshape(-1, 3).astype(np.uint32))
    new: Floats = normals[kept]
    tangents = tangents_along(new, copied.tangents.astype(float))
    return replace(copied, normals=new.astype(np.float32), tangents=tangents.astype(np.float32))


def with_creases(objects: Sequence[SceneObject], angle_deg: float) -> tuple[SceneObject, ...]:
    """The objects, those with `deviating_faces` creased."""
    counts = deviating_faces([o.mesh for o in objects])
    return tuple(replace(o, mesh=creased(o.mesh, angle_deg)) if n else o for o, n in zip(objects, counts, strict=True))
