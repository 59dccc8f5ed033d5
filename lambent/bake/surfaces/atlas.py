"""Second texture coordinates: every triangle of a scene gets a place of its own in one light map."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from lambent.bake.surfaces.charts import Chart, Piece, charts_of, pieces_of
from lambent.bake.surfaces.packing import packed, snapped
from lambent.core.arrays import Floats
from lambent.core.geometry import triangle_areas
from lambent.core.plain import triple
from lambent.core.progress import Progress, silent
from lambent.scenes.scene import Mesh, Scene
from lambent.scenes.variants import documents_of
from lambent.store.contract import ObjectRecord, needs_probe

Sizes = Callable[[Scene, list[Piece], int], Floats]  # of texels on pieces, in metres, for a number of texels


@dataclass(frozen=True)
class Atlas:
    """A scene whose vertices are split along the light map's seams.

    `scene` is the scene with split meshes, `uv2` per object name (V, 2) float32 in [0, 1], `width` and `height` the
    size in texels that the packing was made for.
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

    Its surface takes about `resolution` x `resolution` texels, the map some more. Texels have the `sizes` that a
    function finds, of equal size on all objects without one, over their `light_map_scale`. The size changes from one
    part of an object to the next, none of which is longer than `longest_m`. The result is deterministic.
    """
    progress(0, 1, "unwrapping")
    pieces = pieces_of(scene.objects, longest_m)
    sizes_m = (sizes or even)(scene, pieces, resolution**2)
    charts = charts_of(scene.objects, pieces, sizes_m, progress)
    local, measures = zip(*(snapped(chart.corners) for chart in charts), strict=True)
    places, (width, height) = packed(list(local), list(measures))
    placed = [(corners + place) / (width, height) for corners, place in zip(local, places, strict=True)]
    of_each: list[list[tuple[Chart, Floats]]] = [[] for _ in scene.objects]
    for chart, uv in zip(charts, placed, strict=True):
        of_each[chart.owner].append((chart, uv))
    uv2: dict[str, Floats] = {}
    objects = []
    for o, mine in zip(scene.objects, of_each, strict=True):
        mesh, uv2[o.name] = _split(o.mesh, mine)
        objects.append(replace(o, mesh=mesh))
    progress(1, 1, "unwrapping")
    return Atlas(replace(scene, objects=tuple(objects)), uv2, width, height)


def areas_of(scene: Scene, pieces: list[Piece]) -> Floats:
    """(N,) square metres of pieces."""
    meshes = [scene.objects[piece.owner].mesh for piece in pieces]
    return np.array([triangle_areas(mesh.corners_of(p.faces)).sum() for mesh, p in zip(meshes, pieces, strict=True)])


def scales_of(scene: Scene, pieces: list[Piece]) -> Floats:
    """(N,) `light_map_scale` of pieces."""
    return np.array([scene.objects[piece.owner].light_map_scale for piece in pieces], float)


def even(scene: Scene, pieces: list[Piece], texels: int) -> Floats:
    """Texels of one size on all pieces (N,), over the `light_map_scale` of their objects."""
    areas, scales = areas_of(scene, pieces), scales_of(scene, pieces)
    return np.asarray(np.sqrt((areas * scales**2).sum() / texels) / scales)


def _split(mesh: Mesh, charts: list[tuple[Chart, Floats]]) -> tuple[Mesh, Floats]:
    """The mesh with the vertices of its charts, faces in their old order, and the second coordinates."""
    number, uv2 = np.zeros(mesh.faces.shape, np.int64), np.zeros((*mesh.faces.shape, 2), np.float32)
    for chart, corners in charts:
        number[chart.faces], uv2[chart.faces] = chart.vertices, corners
    _, first, faces = np.unique(number, return_index=True, return_inverse=True)
    source = mesh.faces.reshape(-1)[first]
    split = Mesh(
        mesh.positions[source],
        mesh.normals[source],
        mesh.tangents[source],
        mesh.uv[source],
        faces.reshape(-1, 3).astype(np.uint32),
    )
    return split, uv2.reshape(-1, 2)[first]


def merged(atlas: Atlas) -> dict[str, Floats]:
    """The arrays geometry/* of the store contract: all objects one after another."""
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
    """The atlas that `merged` arrays were made from."""
    objects, uv2, first_face = [], {}, 0
    for o in scene.objects:
        faces = arrays["faces"][first_face : first_face + len(o.mesh.faces)]
        low, high = int(faces.min()), int(faces.max()) + 1
        parts = {name: arrays[name][low:high] for name in ("positions", "normals", "tangents", "uv")}
        objects.append(replace(o, mesh=Mesh(faces=(faces - low).astype(np.uint32), **parts)))
        uv2[o.name] = arrays["uv2"][low:high]
        first_face += len(o.mesh.faces)
    return Atlas(replace(scene, objects=tuple(objects)), uv2, width, height)


def object_records(scene: Scene) -> tuple[ObjectRecord, ...]:
    """The store's record of each object, in the order of `merged`."""
    records, first = [], 0
    for o in scene.objects:
        low, high = o.mesh.bounds
        records.append(ObjectRecord(
            name=o.name, material=o.material, first_face=first, face_count=len(o.mesh.faces), emission=o.emission,
            bounds=(triple(low), triple(high)),
            probe=any(map(needs_probe, documents_of(scene, o.material))),
            part_of=scene.parts.get(o.name, ""), borders=scene.borders.get(o.name, ()),
        ))  # fmt: skip
        first += len(o.mesh.faces)
    return tuple(records)
