"""Shapes under an environment, drawn without a bake, for benches and material previews.

All light is distant, so one probe serves every shape, and the irradiance of a point depends on its normal alone. Shapes
neither shadow nor light each other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import face_directions, texel_solid_angles
from lambent.core.geometry.directions import normalize
from lambent.core.light.colour import HALF_MAX
from lambent.core.plain import Triple, triple
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.realtime.gpu.cube_mips import finite, mip_chain
from lambent.realtime.light.baked import BakedScene, Probe
from lambent.realtime.objects.triangle_blocks import corners_in_blocks, filled_blocks
from lambent.scenes.geometry import merge
from lambent.scenes.scene import Mesh
from lambent.store.contract import ObjectRecord, SceneRecord

COARSE = 16  # texels along a face of the environment for the sum of diffuse light
CAMERA = Camera(name="front", position=(0.0, 0.0, 4.2), target=(0.0, 0.0, 0.0), fov_y_deg=36.0)


def unbaked_scene(
    meshes: Mapping[str, Mesh],
    material: Material,
    environment: Floats,
    planes: Floats | None = None,
    distance: Floats | None = None,
    irradiance: Triple = (0.0, 0.0, 0.0),
    *,
    name: str = "unbaked",
) -> BakedScene:
    """Scene of all `meshes` in one material, each with a probe at the origin that sees `environment` (6, N, N, 3).

    Every point receives the same `irradiance`, W/m^2; see `with_diffuse_light`.
    """
    whole, records, first = merge(meshes.values()), [], 0
    for key, mesh in meshes.items():
        low, high = mesh.bounds
        records.append(
            ObjectRecord(
                name=key, material=material.name, first_face=first, face_count=len(mesh.faces),
                bounds=(triple(low), triple(high)), probe=True,
            )
        )  # fmt: skip
        first += len(mesh.faces)
    low, high = whole.bounds
    record = SceneRecord(
        name=name, objects=tuple(records), materials={material.name: material}, cameras=(CAMERA,),
        bounds=(triple(low), triple(high)),
    )  # fmt: skip
    probe = Probe((0.0, 0.0, 0.0), environment, distance, np.zeros((0, 4), np.float32) if planes is None else planes)
    return BakedScene(
        record, whole.positions, whole.normals, whole.tangents, np.full((len(whole.positions), 2), 0.5, np.float32),
        whole.faces, np.full((4, 4, 3), irradiance, np.float32), None, environment, dict.fromkeys(meshes, probe),
        uv=whole.uv,
    )  # fmt: skip


def with_diffuse_light(scene: BakedScene) -> BakedScene:
    """The scene with light maps of the irradiance from its environment at every vertex, on both sides.

    Triangles of the result do not share vertices (see `triangle_blocks`).
    """
    assert scene.environment is not None, "a scene without an environment has no light from afar"
    corners = scene.faces.reshape(-1)
    count = len(scene.faces)
    across = int(np.ceil(np.sqrt(count)))
    maps = []
    for side in (1, -1):
        at = irradiance(scene.environment, side * normalize(scene.normals.astype(np.float64)))[scene.faces]
        blocks = filled_blocks(at, across)
        maps.append(np.pad(blocks, ((0, 2 * across - len(blocks)), (0, 0), (0, 0))))
    uv2 = corners_in_blocks(count, across) / (2 * across)
    return replace(
        scene,
        positions=scene.positions[corners],
        normals=scene.normals[corners],
        tangents=scene.tangents[corners],
        uv2=uv2.reshape(-1, 2).astype(np.float32),
        uv=None if scene.uv is None else scene.uv[corners],
        faces=np.arange(3 * count, dtype=np.uint32).reshape(-1, 3),
        irradiance=maps[0],
        irradiance_back=maps[1],
    )


def irradiance(environment: Floats, normals: Floats) -> Floats:
    """Irradiance (V, 3), W/m^2, at unit normals (V, 3) under an environment (6, N, N, 3), summed on a coarser cube."""
    unit = max(1.0, float(np.max(environment)) / HALF_MAX)  # a sun is brighter than half floats
    cube = next(level for level in mip_chain(finite(environment / unit)[0]) if level.shape[1] <= COARSE)
    n = cube.shape[1]
    light = (unit * cube * texel_solid_angles(n)[..., None]).reshape(-1, 3)
    cosines = np.maximum(normals @ normalize(face_directions(n)).reshape(-1, 3).T, 0)
    return np.asarray(cosines @ light, np.float32)
