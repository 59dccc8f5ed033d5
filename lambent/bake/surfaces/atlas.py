"""Second texture coordinates: every triangle of a scene gets a place of its own in one light map.

xatlas parametrises and packs. Its time is quadratic in the size of a smooth chart, and it overruns its memory on a
chart of 80,000 triangles: large meshes are cut into pieces first. A cut costs a seam, nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import xatlas

from lambent.core.arrays import Floats, Indices
from lambent.core.errors import UserError
from lambent.core.plain import triple
from lambent.core.progress import Progress, silent
from lambent.scenes.scene import Mesh, Scene
from lambent.store.contract import ObjectRecord, needs_probe

PIECE_FACES = 1500  # more per piece is slower, fewer cost seams
PADDING_TEXELS = 2  # between charts, so that a bilinear look-up stays within the texels of its own chart


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


def unwrap(scene: Scene, resolution: int, progress: Progress = silent) -> Atlas:
    """Parametrise all objects of a scene into one light map of about `resolution` x `resolution` texels.

    The packing decides the exact size; texels are equally dense on all objects, times their `light_map_scale`. The
    result is deterministic.
    """
    pieces = [(o, part) for o in scene.objects for part in _pieces(o.mesh)]
    atlas = xatlas.Atlas()
    # xatlas ignores triangles below 1.2e-7 of its units squared: a scene of centimetres is enlarged, without rounding.
    unit = 2.0 ** max(0, np.ceil(-np.log2(np.ptp(scene.bounds, axis=0).max())))
    for o, part in pieces:
        vertices, faces = np.unique(o.mesh.faces[part], return_inverse=True)
        faces = np.ascontiguousarray(faces.reshape(-1, 3), dtype=np.uint32)
        try:
            atlas.add_mesh(
                o.mesh.positions[vertices] * np.float32(unit * o.light_map_scale), faces, o.mesh.normals[vertices]
            )
        except (RuntimeError, ValueError) as error:
            raise UserError(f"object cannot be unwrapped ({error})", field=o.name) from error
    progress(0, 1, "unwrapping")
    packing = xatlas.PackOptions()
    packing.resolution, packing.padding, packing.bilinear = resolution, PADDING_TEXELS, True
    atlas.generate(xatlas.ChartOptions(), packing, False)
    assert atlas.atlas_count == 1, "an estimated texel density packs into one page"
    uv2: dict[str, Floats] = {}
    objects = []
    for o in scene.objects:
        mine = [(part, atlas[i]) for i, (owner, part) in enumerate(pieces) if owner is o]
        mesh, uv2[o.name] = _split(o.mesh, mine)
        objects.append(replace(o, mesh=mesh))
    progress(1, 1, "unwrapping")
    return Atlas(replace(scene, objects=tuple(objects)), uv2, atlas.width, atlas.height)


def _pieces(mesh: Mesh) -> list[Indices]:
    """Face numbers in spatially compact pieces of at most PIECE_FACES faces (halved at the median, longest side)."""
    centres = mesh.positions[mesh.faces].mean(axis=1)
    pieces: list[Indices] = []
    left: list[Indices] = [np.arange(len(mesh.faces))]
    while left:
        part = left.pop()
        if len(part) <= PIECE_FACES:
            pieces.append(np.sort(part))
            continue
        axis = np.argmax(np.ptp(centres[part], axis=0))
        order = part[np.argsort(centres[part, axis], kind="stable")]
        left += [order[len(order) // 2 :], order[: len(order) // 2]]
    return pieces


def _split(mesh: Mesh, parts: list[tuple[Indices, tuple[Floats, Floats, Floats]]]) -> tuple[Mesh, Floats]:
    """The mesh with the vertices of its unwrapped pieces, faces in their old order, and the second coordinates."""
    faces = np.empty_like(mesh.faces, dtype=np.uint32)
    sources, coordinates, first = [], [], 0
    for part, (vmapping, indices, uv) in parts:
        vertices = np.unique(mesh.faces[part])
        faces[part] = indices + first
        sources.append(vertices[vmapping])
        coordinates.append(uv)
        first += len(vmapping)
    source = np.concatenate(sources)
    split = Mesh(mesh.positions[source], mesh.normals[source], mesh.tangents[source], mesh.uv[source], faces)
    return split, np.concatenate(coordinates).astype(np.float32)


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
            bounds=(triple(low), triple(high)), probe=needs_probe(scene.materials[o.material]),
        ))  # fmt: skip
        first += len(o.mesh.faces)
    return tuple(records)
