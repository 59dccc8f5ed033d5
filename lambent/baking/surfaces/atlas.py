"""Second texture coordinates: every triangle of a scene gets its own place in one light map."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from lambent.baking.surfaces.charts import Chart, Piece, charts_of, pieces_of
from lambent.baking.surfaces.copies import copies_of
from lambent.baking.surfaces.packing import packed, snapped
from lambent.core.arrays import Floats, Indices
from lambent.core.plain import triple
from lambent.core.progress import Progress, silent
from lambent.scenes.looks.variants import documents_of
from lambent.scenes.mesh import areas_of_faces, boxes_of
from lambent.scenes.scene import Mesh, Scene
from lambent.store.contract import ObjectRecord, needs_probe

Sizes = Callable[[list[Piece], int], Floats]  # texel sizes on pieces, in metres, for a number of texels


@dataclass(frozen=True)
class Atlas:
    """A scene whose vertices are split along the light map's seams.

    `scene` has the split meshes, `uv2` by object name is (V, 2) float32 in [0, 1], `width` and `height` are the size in
    texels for which the map was packed.
    """

    scene: Scene
    uv2: dict[str, Floats]
    width: int
    height: int


def unwrap(
    scene: Scene,
    resolution: int,
    progress: Progress = silent,
    sizes: Sizes | None = None,
    longest_m: float = np.inf,
) -> Atlas:
    """Parametrise all objects of a scene into one light map.

    Its surface takes about `resolution` x `resolution` texels, and the map slightly more. The function `sizes` chooses
    the texel sizes; by default they are equal on all objects. They are divided by `light_map_scale`. The size can
    change between parts of an object, which are no longer than `longest_m`. The result is deterministic.
    """
    progress(0, 1, "unwrapping")
    copies = copies_of([o.mesh for o in scene.objects])
    pieces = pieces_of(scene.objects, copies, longest_m)
    owner = np.array([piece.owner for piece in pieces])
    sizes_m = copies.stepped(owner, (sizes or partial(even, scene))(pieces, resolution**2))
    charts = charts_of(scene.objects, pieces, sizes_m, copies, progress)
    once = {id(own): own for own in charts}
    shapes = {key: [snapped(chart.corners) for chart in own] for key, own in once.items()}
    seams = {key: _seams(own, [local for local, _ in shapes[key]]) for key, own in once.items()}
    first = dict(zip(shapes, np.cumsum([0, *map(len, shapes.values())]).tolist(), strict=False))
    which = np.concatenate([np.arange(len(own)) + first[id(own)] for own in charts])
    places, (width, height) = packed([one for own in shapes.values() for one in own], which)
    uv2: dict[str, Floats] = {}
    objects, begins = [], 0
    for o, own in zip(scene.objects, charts, strict=True):
        source, faces, chart, local = seams[id(own)]
        at = places[begins : begins + len(own)]
        begins += len(own)
        uv2[o.name] = ((local + at[chart]) / (width, height)).astype(np.float32)
        objects.append(replace(o, mesh=_split(o.mesh, source, faces)))
    progress(1, 1, "unwrapping")
    return Atlas(replace(scene, objects=tuple(objects)), uv2, width, height)


def areas_of(scene: Scene, pieces: list[Piece]) -> Floats:
    """(N,) areas of pieces in m^2."""
    first = np.cumsum([0] + [len(o.mesh.faces) for o in scene.objects])
    areas = areas_of_faces([o.mesh for o in scene.objects])
    return np.array([areas[first[piece.owner] + piece.faces].sum() for piece in pieces])


def scales_of(scene: Scene, pieces: list[Piece]) -> Floats:
    """(N,) `light_map_scale` of pieces."""
    return np.array([scene.objects[piece.owner].light_map_scale for piece in pieces], float)


def even(scene: Scene, pieces: list[Piece], texels: int) -> Floats:
    """Equal texel sizes on all pieces (N,), divided by the `light_map_scale` of their objects."""
    areas, scales = areas_of(scene, pieces), scales_of(scene, pieces)
    return np.asarray(np.sqrt((areas * scales**2).sum() / texels) / scales)


def _seams(charts: list[Chart], corners: list[Floats]) -> tuple[Indices, NDArray[np.uint32], Indices, Floats]:
    """Vertices of a mesh split along its charts, whose `corners` (K, 3, 2) are in texels.

    Returns, per vertex, its corner (V,) of the mesh's faces, numbered consecutively; faces (F, 3) uint32 in their
    original order; and the chart of each vertex (V,), with its place there (V, 2).
    """
    count = sum(len(chart.faces) for chart in charts)
    number, place = np.zeros((count, 3), np.int64), np.zeros((count, 3, 2))
    chart_of = np.zeros((count, 3), np.int64)
    for i, (chart, local) in enumerate(zip(charts, corners, strict=True)):
        number[chart.faces], place[chart.faces], chart_of[chart.faces] = chart.vertices, local, i
    _, first, faces = np.unique(number, return_index=True, return_inverse=True)
    return first, faces.reshape(-1, 3).astype(np.uint32), chart_of.reshape(-1)[first], place.reshape(-1, 2)[first]


def _split(mesh: Mesh, corner: Indices, faces: NDArray[np.uint32]) -> Mesh:
    """The mesh with a vertex for each of these corners (V,) of its faces, numbered consecutively."""
    return mesh.at_vertices(mesh.faces.reshape(-1)[corner], faces)


def merged(atlas: Atlas) -> dict[str, Floats]:
    """The arrays geometry/* of the store contract: all objects concatenated."""
    meshes = [o.mesh for o in atlas.scene.objects]
    first = np.cumsum([0] + [len(mesh.positions) for mesh in meshes])
    arrays = {
        name: np.concatenate([getattr(mesh, name) for mesh in meshes]).astype(np.float32)
        for name in ("positions", "normals", "tangents", "uv")
    }
    arrays["uv2"] = np.concatenate([atlas.uv2[o.name] for o in atlas.scene.objects])
    arrays["faces"] = np.concatenate([m.faces + f for m, f in zip(meshes, first[:-1], strict=True)]).astype(np.uint32)
    return arrays


def separated(scene: Scene, arrays: dict[str, Floats], width: int, height: int) -> Atlas:
    """The atlas from which `merged` arrays were made."""
    objects, uv2, first_face = [], {}, 0
    for o in scene.objects:
        mesh, uv2[o.name] = mesh_of_faces(arrays, first_face, len(o.mesh.faces))
        objects.append(replace(o, mesh=mesh))
        first_face += len(o.mesh.faces)
    return Atlas(replace(scene, objects=tuple(objects)), uv2, width, height)


def mesh_of_faces(arrays: dict[str, Floats], first: int, count: int) -> tuple[Mesh, Floats]:
    """The mesh of consecutive faces of `merged` arrays, and its light map coordinates (V, 2)."""
    faces = arrays["faces"][first : first + count]
    own = slice(int(faces.min()), int(faces.max()) + 1)
    positions, normals, tangents, uv = (arrays[name][own] for name in ("positions", "normals", "tangents", "uv"))
    return Mesh(positions, normals, tangents, uv, (faces - own.start).astype(np.uint32)), arrays["uv2"][own]


def object_records(scene: Scene) -> tuple[ObjectRecord, ...]:
    """The store's record of each object, in the order of `merged`."""
    records, first = [], 0
    boxes = boxes_of([o.mesh for o in scene.objects]).tolist()
    used = {o.material for o in scene.objects}
    wants_probe = {material: any(map(needs_probe, documents_of(scene, material))) for material in used}
    for o, (low, high) in zip(scene.objects, boxes, strict=True):
        records.append(ObjectRecord(
            name=o.name, material=o.material, first_face=first, face_count=len(o.mesh.faces), emission=o.emission,
            luminaire=o.luminaire, bounds=(triple(low), triple(high)),
            probe=wants_probe[o.material],
            part_of=scene.parts.get(o.name, ""), borders=scene.borders.get(o.name, ()),
        ))  # fmt: skip
        first += len(o.mesh.faces)
    return tuple(records)
