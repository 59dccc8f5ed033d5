"""A store written by hand: a floor, a wall and a glossy ball, so that tests of the window need no bake."""

import numpy as np

from lambent.core.geometry.cubemap import face_directions
from lambent.core.geometry.directions import normalize
from lambent.core.views.camera import Camera, CameraPath
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import merge, patch, placed, sphere
from lambent.scenes.sky.environments import studio
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


SUN = (0.6, 0.64, 0.48)  # towards it


def with_light_groups(folder):
    """The small store with its light in three groups, a sun with a disc of 50 W/(sr m^2), and the wall as the lamp."""
    store = Store.open(folder)
    shares = np.array([0.25, 0.5, 0.25], np.float32)  # of lamp, sky and sun
    sun = {"direction": SUN, "irradiance": (4.0, 4.0, 3.0), "radius_rad": 0.05}
    names = (("lamp", "wall"), ("sky", "sky"), ("sun", "sun"))
    groups = [{"name": n, "members": [m], "share": float(s)} for (n, m), s in zip(names, shares, strict=True)]
    light = store.read("light_map/irradiance").astype(np.float32)
    cube = store.read("probe/ball/radiance").astype(np.float32)
    n = cube.shape[1]
    w = normalize(face_directions(n))
    disc = np.where((w @ np.array(SUN) > np.cos(0.06))[..., None], np.float32(50.0), np.float32(0.0))
    of_probe = cube * shares.reshape(3, 1, 1, 1, 1)
    of_probe[2] += disc
    arrays = {
        "light_map/irradiance": (light, {"sun": sun}),
        "light_map/groups": (light * shares.reshape(3, 1, 1, 1), {"groups": groups}),
        "environment/radiance": (cube + disc, {}),
        "probe/ball/radiance": (of_probe.sum(axis=0), {"centre": [0.0, 1.0, 0.0]}),
        "probe/ball/groups": (of_probe, {"centre": [0.0, 1.0, 0.0]}),
    }
    for name, (array, meta) in arrays.items():
        store.put(name, name.split("/")[0], array.astype(np.float16), key="by hand, by group", meta=meta)
    store.close()
    return folder
