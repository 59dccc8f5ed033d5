"""Convert a file's arrays to a mesh that can be baked: create missing arrays, drop broken triangles, with notes.

Polygons become triangles, and files without normals get some. Edges are hard where asked for: smooth normals across
them deviate far from the faces', and shade a box like a ball.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import MIXERS, Flags, Floats, Indices, hashes, sums_of
from lambent.core.errors import UserError
from lambent.core.geometry.directions import basis, normalize
from lambent.core.geometry.triangles import area_vectors, corner_angles, cross_2d, triangle_areas, triangle_normals
from lambent.scenes.geometry import tangents_along
from lambent.scenes.geometry.grid import FLAT
from lambent.scenes.mesh import batches_of, corners_of, vertices_at_corners
from lambent.scenes.scene import Mesh, SceneObject

ABSURD = 1e15
DEVIATION_DEG = 40.0  # of a normal from its face's, above which it is reported; a smooth prism of 10 sides has 18
DEVIATION_SHARE = 0.2  # of an object's area: the normals of fillets deviate, and are meant to
NAMED = 2
MEETING = 256  # faces in one place, of which normals are the mean
CORNERS_AT_ONCE = 1 << 20


@dataclass(frozen=True)
class MeshArrays:
    """Arrays of a file: positions, normals, tangents (V, 3), uv (V, 2), triangles (T, 3) integer, counter-clockwise.

    Normals, uv and tangents may be absent.
    """

    positions: Floats
    triangles: NDArray[np.integer]
    normals: Floats | None = None
    uv: Floats | None = None
    tangents: Floats | None = None

    def smooth(self) -> MeshArrays:
        """The arrays with smooth normals, if they have none."""
        if self.normals is not None or not len(self.triangles) or int(self.triangles.max()) >= len(self.positions):
            return self
        normals = np.zeros_like(self.positions)
        made = smooth_normals(self.positions, self.triangles, self.triangles)
        normals[: len(made)] = made
        return replace(self, normals=normals)


def mesh_of(
    arrays: MeshArrays, *, name: str, file: Path, crease_deg: float | None = None
) -> tuple[Mesh | None, list[str]]:
    """Mesh of arrays read from a file, None if no triangle is left, and notes of repairs.

    Missing normals become flat ones, or, with `crease_deg`, those of `creased`; missing uv box-mapped metres, missing
    tangents the direction of u.

    Raises
    ------
    UserError
        If a triangle refers to a missing vertex.
    """
    notes: list[str] = []
    positions, faces = _tame(arrays.positions), arrays.triangles
    normals, uv, tangents = (None if a is None else _tame(a) for a in (arrays.normals, arrays.uv, arrays.tangents))
    if faces.size and int(faces.max()) >= len(positions):
        got, expected = int(faces.max()), f"below {len(positions)}"
        raise UserError("face index out of range", file=file, field=name, got=got, expected=expected)
    faces = _usable(positions, faces, notes)
    if not len(faces):
        return None, [f"{name}: left out, no triangle has an area ({'; '.join(notes) or 'empty'})"]
    faces = _once(positions, faces, normals is None, uv, notes)
    smoothed = crease_deg if normals is None else None
    if normals is None:  # every triangle gets its own vertices
        own = faces.reshape(-1)
        faces = np.arange(len(own)).reshape(-1, 3)
        positions, uv, tangents = positions[own], _at(uv, own), _at(tangents, own)
        normals = np.repeat(triangle_normals(positions[faces]), 3, axis=0)
        how = "faces are flat" if smoothed is None else f"smooth where faces meet at less than {smoothed:g} degrees"
        notes.append(f"no normals: {how}")
    else:
        normals = _unit_normals(positions, faces, normals, notes)
    if uv is None:
        uv = box_mapped(positions, normals)
        notes.append("no uv: box-mapped, one unit per metre")
    elif not np.isfinite(uv).all():
        uv = np.nan_to_num(uv, nan=0.0, posinf=0.0, neginf=0.0)
        notes.append("uv not finite: set to 0")
    direction = _along_u(positions, faces, uv) if tangents is None else np.nan_to_num(tangents)
    used, index = np.unique(faces, return_inverse=True)
    mesh = Mesh(
        positions[used].astype(np.float32),
        normals[used].astype(np.float32),
        tangents_along(normals, direction)[used].astype(np.float32),
        uv[used].astype(np.float32),
        index.reshape(-1, 3).astype(np.uint32),
    )
    return mesh if smoothed is None else creased(mesh, smoothed), [f"{name}: {what}" for what in notes]


def _tame(values: Floats) -> Floats:
    """`values` with NaN for extremely large ones, whose squares would overflow in single precision."""
    with np.errstate(invalid="ignore"):
        return np.where(np.abs(values) < ABSURD, values, np.nan)


def _at(values: Floats | None, index: NDArray[np.integer]) -> Floats | None:
    return None if values is None else values[index]


def _usable(positions: Floats, faces: NDArray[np.integer], notes: list[str]) -> NDArray[np.integer]:
    """Faces with finite corners and positive area, in float32, as they will be stored."""
    finite = np.asarray(np.isfinite(positions).all(axis=-1))[faces].all(axis=-1)
    if not finite.all():
        notes.append(f"{int((~finite).sum())} triangles dropped: a vertex is not finite")
    faces = faces[finite]
    if not len(faces):
        return faces
    extent = float(np.ptp(positions[np.unique(faces)], axis=0).max())
    wide = triangle_areas(positions.astype(np.float32)[faces].astype(float)) > FLAT * extent**2
    if not wide.all():
        notes.append(f"{int((~wide).sum())} triangles dropped: no area")
    return faces[wide]


def _once(
    positions: Floats, faces: NDArray[np.integer], flat: bool, uv: Floats | None, notes: list[str]
) -> NDArray[np.integer]:
    """Faces without copies of others, turned round or not: surfaces are two-sided, and equal ones hide each other.

    Copies have the same vertices; in `flat` meshes, which have no normals, vertices of equal position and uv count.
    """
    corners = faces.astype(np.int64)
    if flat:
        rows = hashes(positions) if uv is None else hashes(positions) + 3 * hashes(uv)
        corners = np.unique(rows, return_inverse=True)[1].reshape(-1)[faces].astype(np.int64)
    first = np.unique(np.sort(corners, axis=1) @ MIXERS[:3], return_index=True)[1]
    if len(first) < len(faces):
        notes.append(f"{len(faces) - len(first)} triangles dropped: doubled")
    return faces[np.sort(first)]


def _unit_normals(positions: Floats, faces: NDArray[np.integer], normals: Floats, notes: list[str]) -> Floats:
    """Unit normals; those without a direction become the mean of their faces'."""
    length = np.linalg.norm(np.nan_to_num(normals), axis=-1)
    broken = np.asarray(~np.isfinite(normals).all(axis=-1) | (length < 1e-6))
    unit = normalize(np.nan_to_num(normals))
    broken &= np.isin(np.arange(len(normals)), faces)
    if broken.any():
        mean = np.zeros_like(positions)
        vectors = area_vectors(positions[faces])
        for corner in range(3):
            np.add.at(mean, faces[:, corner], vectors)
        unit[broken] = normalize(mean)[broken]
        notes.append(f"{int(broken.sum())} normals had no direction: replaced by face normals")
    unit[np.linalg.norm(unit, axis=-1) < 0.5] = (0.0, 1.0, 0.0)  # for faces that cancel, and unused vertices
    return unit


def box_mapped(positions: Floats, normals: Floats) -> Floats:
    """uv (V, 2) in metres: the two axes other than that of the largest normal component."""
    kept = np.array([(2, 1), (0, 2), (0, 1)])[np.argmax(np.abs(normals), axis=-1)]
    return np.take_along_axis(np.nan_to_num(positions), kept, axis=-1)


def _along_u(positions: Floats, faces: NDArray[np.integer], uv: Floats) -> Floats:
    """Direction (V, 3) of increasing u, averaged over the faces of each vertex; +x if uv does not determine it."""
    finite = np.nan_to_num(positions)
    a, b, c = (finite[faces[:, i]] for i in range(3))
    ua, ub, uc = (uv[faces[:, i]] for i in range(3))
    d1, d2 = ub - ua, uc - ua
    along = np.sign(cross_2d(d1, d2))[:, None] * ((b - a) * d2[:, 1:] - (c - a) * d1[:, 1:])
    total = np.zeros_like(finite)
    for corner in range(3):
        np.add.at(total, faces[:, corner], normalize(along))
    lost = np.linalg.norm(total, axis=-1) < 1e-6
    total[lost] = basis(np.array([0.0, 1.0, 0.0]))[0]
    return total


def triangulate(positions: Floats, corners: Indices, sizes: Indices) -> tuple[Indices, Indices]:
    """Triangles of polygons.

    Parameters
    ----------
    positions : (V, 3)
    corners : (C,) int64
        Vertex of every corner, polygon after polygon.
    sizes : (F,) int64
        Number of corners of each polygon; polygons of fewer than three give no triangle.

    Returns
    -------
    triangles : (T, 3) int64
        Places in `corners`, in each polygon's own sense.
    polygon : (T,) int64
        The polygon of each, ascending.
    """
    starts = np.cumsum(sizes) - sizes
    triangles, polygon = [np.zeros((0, 3), np.int64)], [np.zeros(0, np.int64)]
    for size in np.unique(sizes[sizes >= 3]):
        which = np.flatnonzero(sizes == size)
        places = starts[which][:, None] + np.arange(size)
        if size > 3:
            hollow = ~_convex(positions[corners[places]])
            for row in np.flatnonzero(hollow):
                cut = _clipped(positions[corners[places[row]]])
                triangles.append(places[row][cut])
                polygon.append(np.full(len(cut), which[row]))
            which, places = which[~hollow], places[~hollow]
        triangles.append(places[:, _fan(size)].reshape(-1, 3))
        polygon.append(np.repeat(which, size - 2))
    order = np.argsort(np.concatenate(polygon), kind="stable")
    return np.concatenate(triangles)[order], np.concatenate(polygon)[order]


def _newell(points: Floats) -> Floats:
    """Normal (..., 3), twice the area long, of polygons (..., n, 3)."""
    relative = points - points[..., :1, :]
    normal: Floats = np.cross(relative, np.roll(relative, -1, axis=-2)).sum(axis=-2)
    return normal


def _convex(points: Floats) -> Flags:
    """(F,) whether polygons (F, n, 3) turn one way at every corner; nonfinite ones count as convex."""
    with np.errstate(invalid="ignore", over="ignore"):
        edges = np.roll(points, -1, axis=1) - points
        turns = np.sum(np.cross(edges, np.roll(edges, -1, axis=1)) * _newell(points)[:, None], axis=-1)
        hollow = (turns < -1e-9 * np.abs(turns).max(axis=1, keepdims=True)).any(axis=1)
    return np.asarray(~hollow)


def _clipped(points: Floats) -> Indices:
    """Triangles (T, 3) of one polygon (n, 3) by ear clipping in its own plane."""
    from mapbox_earcut import triangulate_float64

    t, b = basis(normalize(_newell(points)))
    flat = np.ascontiguousarray(np.stack([points @ t, points @ b], axis=-1))
    cut = triangulate_float64(flat, np.array([len(points)], np.uint32)).reshape(-1, 3).astype(np.int64)
    if not len(cut):
        return _fan(len(points))
    a, b, c = (flat[cut[:, i]] for i in range(3))
    return np.where((cross_2d(b - a, c - a) < 0)[:, None], cut[:, ::-1], cut)


def _fan(corners: int) -> Indices:
    """Triangles (corners - 2, 3) of a convex polygon."""
    return np.stack([np.zeros(corners - 2, int), np.arange(1, corners - 1), np.arange(2, corners)], axis=-1)


def smooth_normals(positions: Floats, triangles: NDArray[np.integer], shared: NDArray[np.integer]) -> Floats:
    """Unit normals (K, 3), each the mean of its triangles' normals weighted by their angles there.

    Parameters
    ----------
    positions : (V, 3)
    triangles : (T, 3) int
        Vertices.
    shared : (T, 3) int
        The normal of each corner, out of K.
    """
    corner = positions[triangles]
    total = np.zeros((int(shared.max()) + 1 if shared.size else 0, 3))
    with np.errstate(invalid="ignore", over="ignore"):
        normal, angles = normalize(np.nan_to_num(area_vectors(corner))), np.nan_to_num(corner_angles(corner))
        for i in range(3):
            total += sums_of(angles[:, i, None] * normal, shared[:, i], len(total))
    return normalize(total)


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
        total[start:stop] = sums_of(vectors[other[near]], own[near] - start, stop - start)
        start = stop
    return total


def with_creases(objects: Sequence[SceneObject], angle_deg: float) -> tuple[SceneObject, ...]:
    """The objects, those with `deviating_faces` creased."""
    counts = deviating_faces([o.mesh for o in objects])
    return tuple(replace(o, mesh=creased(o.mesh, angle_deg)) if n else o for o, n in zip(objects, counts, strict=True))
