"""A store written by hand: a floor, a wall and a glossy ball, so that tests of the window need no bake."""

import numpy as np

from lambent.core.camera import Camera, CameraPath
from lambent.materials.document import Lobe, Material
from lambent.scenes.environments import studio
from lambent.scenes.geometry import merge, patch, placed, sphere
from lambent.store.contract import ObjectRecord, SceneRecord, write_scene_record
from lambent.store.store import Store

MATERIALS = {
    "plaster": Material(name="plaster", kd=(0.6, 0.55, 0.5)),
    "brass": Material(name="brass", kd=0.02, lobes=(Lobe(mx=0.1, my=0.1, r0=(0.9, 0.7, 0.4)),)),
}
FRONT = Camera(name="front", position=(0, 1.6, 3), target=(0, 1, 0), fov_y_deg=60)
SIDE = Camera(name="side", position=(3, 1.6, 0.5), target=(0, 1, 0), fov_y_deg=60)


def write_small_store(folder):
    parts = {
        "floor": ("plaster", patch((-4, 0, 4), (8, 0, 0), (0, 0, -8))),
        "wall": ("plaster", patch((-4, 0, -4), (8, 0, 0), (0, 2.6, 0))),
        "ball": ("brass", placed(sphere(0.6, 32, 16), (0, 1, 0))),
    }
    whole, objects, first = merge([mesh for _, mesh in parts.values()]), [], 0
    for name, (material, mesh) in parts.items():
        bounds = tuple(tuple(map(float, corner)) for corner in mesh.bounds)
        objects.append(
            ObjectRecord(
                name=name, material=material, first_face=first, face_count=len(mesh.faces), bounds=bounds,
                probe=name == "ball",
            )
        )  # fmt: skip
        first += len(mesh.faces)
    arrays = {
        "geometry/positions": whole.positions,
        "geometry/normals": whole.normals,
        "geometry/tangents": whole.tangents,
        "geometry/uv": whole.uv,
        "geometry/uv2": np.full((len(whole.positions), 2), 0.5, np.float32),
        "geometry/faces": whole.faces,
        "light_map/irradiance": np.full((4, 4, 3), 2.0, np.float16),
        "environment/radiance": studio(32).astype(np.float16),
        "probe/ball/radiance": studio(32).astype(np.float16),
    }
    store = Store.create(folder, {})
    for name, array in arrays.items():
        meta = {"centre": [0.0, 1.0, 0.0]} if name.startswith("probe") else {}
        store.put(name, name.split("/")[0], array, key="by hand", meta=meta)
    write_scene_record(
        store,
        SceneRecord(
            name="small room", objects=tuple(objects), materials=MATERIALS, cameras=(FRONT, SIDE),
            paths=(CameraPath(name="tour", keys=(FRONT, SIDE), seconds=3),),
            bounds=((-4.0, 0.0, -4.0), (4.0, 2.6, 4.0)),
        ),
    )  # fmt: skip
    return folder
