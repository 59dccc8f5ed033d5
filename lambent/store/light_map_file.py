"""The light map for other programs: an EXR image, and beside it the meshes with the coordinates that it is read at."""

from __future__ import annotations

from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.errors import UserError
from lambent.core.files import write_bytes
from lambent.core.glb import glb_bytes
from lambent.core.pictures.images import write_image
from lambent.store.contract import SIDES, scene_record, whole_objects
from lambent.store.store import Store

ATTRIBUTES = {"positions": "POSITION", "normals": "NORMAL", "uv": "TEXCOORD_0", "uv2": "TEXCOORD_1"}
FLOAT, UNSIGNED = 5126, 5125  # of glTF's components


def meshes_beside(image: Path) -> Path:
    """The .glb that belongs to a light map's image."""
    return image.with_suffix(".glb")


def write_light_map(store: Store, image: Path) -> None:
    """Write irradiance, W/m^2 (.exr), and the objects with uv2 as their second coordinates (.glb of the same name).

    The direct light of a sun is not in it: `contract`, light_map/irradiance.

    Raises
    ------
    UserError
        If the store has no complete light map, or a file cannot be written.
    """
    name = f"light_map/{SIDES[0]}"
    if store.availability(name)[0] != "complete":
        raise UserError("has no light map", file=store.folder, hint="bake it: lambent bake SCENE -o STORE")
    write_image(image, store.read(name).astype(np.float32))
    write_bytes(meshes_beside(image), _meshes(store))


def _meshes(store: Store) -> bytes:
    """All objects share four arrays of vertices and one of indices."""
    arrays = {name: store.read(f"geometry/{name}") for name in (*ATTRIBUTES, "faces")}
    arrays["uv"] = arrays["uv"] * (1, -1) + (0, 1)  # glTF has v down; uv2 has it already
    parts = [array.astype("<u4" if name == "faces" else "<f4").tobytes() for name, array in arrays.items()]
    starts = [0, *accumulate(map(len, parts))]
    vertices: list[dict[str, Any]] = [
        {"bufferView": i, "componentType": FLOAT, "count": len(arrays[name]), "type": f"VEC{arrays[name].shape[1]}"}
        for i, name in enumerate(ATTRIBUTES)
    ]
    vertices[0] |= {"min": arrays["positions"].min(axis=0).tolist(), "max": arrays["positions"].max(axis=0).tolist()}
    faces = {"bufferView": len(vertices), "componentType": UNSIGNED, "type": "SCALAR"}
    objects = whole_objects(scene_record(store).objects)
    attributes = {to: i for i, to in enumerate(ATTRIBUTES.values())}
    document = {
        "asset": {"version": "2.0", "generator": "Lambent"}, "scene": 0,
        "scenes": [{"nodes": list(range(len(objects)))}],
        "nodes": [{"mesh": i, "name": o.name} for i, o in enumerate(objects)],
        "meshes": [
            {"name": o.name, "primitives": [{"attributes": attributes, "indices": len(vertices) + i}]}
            for i, o in enumerate(objects)
        ],
        "accessors": [
            *vertices, *({**faces, "byteOffset": 12 * o.first_face, "count": 3 * o.face_count} for o in objects)
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": len(part)}
            for start, part in zip(starts, parts, strict=False)
        ],
        "buffers": [{"byteLength": starts[-1]}],
    }  # fmt: skip
    return glb_bytes(document, b"".join(parts))
