"""The scene of the planar benches, in memory: a floor and a wall, with a cube, a cylinder, a ball, a lamp and a pole.

Everything above the floor is diffuse and patterned, so that its reflection can be traced exactly: `exact_reflection`
casts rays at the triangles that the renderer draws, and reads the same light map.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.plain import Triple
from lambent.core.progress import Progress, silent
from lambent.core.views.camera import Camera, pixel_rays
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.baked import BakedScene
from lambent.realtime.objects.unbaked import unbaked_scene
from lambent.scenes.geometry import box, cylinder, patch, placed, sphere, turn
from lambent.scenes.scene import ConstantEnvironment, Mesh, Scene, SceneObject
from lambent.store.contract import ReflectorPart, ReflectorRecord

FLOOR, PAINT, REACH = "floor", "paint", 4.0
SKY: Triple = (0.25, 0.3, 0.4)
LAMP: Triple = (12.0, 10.0, 8.0)  # radiance of a black ball
CAMERA = Camera(name="front", position=(0.5, 1.55, 4.2), target=(0.0, 0.35, 0.0), fov_y_deg=42.0)
COLOURS: Mapping[str, Triple] = {
    "wall": (0.75, 0.7, 0.6), "cube": (0.8, 0.25, 0.15), "cylinder": (0.2, 0.5, 0.75), "ball": (0.3, 0.7, 0.3),
    "pole": (0.1, 0.1, 0.12),
}  # fmt: skip
TILE_TEXELS = 256  # of the light map, for each object


def meshes() -> dict[str, Mesh]:
    """All shapes; the floor is the plane y = 0."""
    return {
        "wall": patch((-REACH, 0, -2), (2 * REACH, 0, 0), (0, 3.2, 0)),
        "cube": placed(box((0.7, 0.7, 0.7)), (-0.9, 0.35, 0.1), turn("y", 25)),
        "cylinder": placed(cylinder(0.3, 1.1, 64), (0.15, 0.0, -0.7)),
        "ball": placed(sphere(0.36, 64, 32), (0.95, 0.36, 0.35)),
        "pole": placed(cylinder(0.025, 2.2, 24), (0.45, 0.0, 0.75)),
        "lamp": placed(sphere(0.12, 32, 16), (-0.25, 1.35, 0.2)),
        FLOOR: patch((-REACH, 0, REACH), (2 * REACH, 0, 0), (0, 0, -2 * REACH)),
    }


def floor_state(lobe: Lobe, width: int, height: int) -> FrameState:
    """The frame that shows the specular light of a floor with one lobe."""
    materials = {FLOOR: Material(name=FLOOR, lobes=(lobe,))}
    return FrameState(CAMERA, width, height, show="specular", antialias=False, materials=materials)


def planar_scene(lobe: Lobe) -> BakedScene:
    """The scene with a floor of one lobe."""
    shapes = meshes()
    sky = np.tile(np.array(SKY, np.float32), (6, 4, 4, 1))
    scene = unbaked_scene(shapes, Material(name=PAINT, kd=(1, 1, 1)), sky, name="planar bench")
    changes: dict[str, dict[str, object]] = {FLOOR: {"material": FLOOR}, "lamp": {"emission": LAMP}}
    objects = tuple(o.model_copy(update=changes.get(o.name, {})) for o in scene.record.objects)
    outline = ((-REACH, 0, -REACH), (-REACH, 0, REACH), (REACH, 0, REACH), (REACH, 0, -REACH))
    part = ReflectorPart(object=FLOOR, faces=(0, 1), area_m2=4 * REACH * REACH)
    reflector = ReflectorRecord(plane=(0, 1, 0, 0), outline=outline, parts=(part,))
    materials = {PAINT: scene.record.materials[PAINT], FLOOR: Material(name=FLOOR, lobes=(lobe,))}
    record = scene.record.model_copy(update={"objects": objects, "materials": materials, "reflectors": (reflector,)})
    uv2 = np.concatenate(list(light_map_places(shapes).values()))
    return replace(scene, record=record, uv2=uv2, irradiance=light_map(shapes))


def light_map(shapes: Iterable[str]) -> Floats:
    """Irradiance (TILE_TEXELS, TILE_TEXELS shapes, 3): a tile of checks per shape, brighter to the right."""
    at = (np.arange(TILE_TEXELS) + 0.5) / TILE_TEXELS
    u, v = np.meshgrid(at, at)
    checks = np.where((np.floor(u * 10) + np.floor(v * 10)) % 2 == 0, 1.0, 0.45) * (0.6 + 0.6 * u)
    tiles = [np.pi * checks[..., None] * np.array(COLOURS.get(name, (0, 0, 0))) for name in shapes]
    return np.concatenate(tiles, axis=1).astype(np.float32)


def light_map_places(shapes: Mapping[str, Mesh]) -> dict[str, Floats]:
    """Coordinates uv2 (V, 2) of each shape: its texture coordinates, spread over its tile."""
    places = {}
    for i, (name, mesh) in enumerate(shapes.items()):
        uv = mesh.uv.astype(float)
        low, span = uv.min(axis=0), np.maximum(np.ptp(uv, axis=0), 1e-6)
        inner = 0.02 + 0.96 * (uv - low) / span
        places[name] = np.column_stack([(i + inner[:, 0]) / len(shapes), inner[:, 1]]).astype(np.float32)
    return places


def exact_reflection(
    lobe: Lobe, camera: Camera, width: int, height: int, spp: int, progress: Progress = silent
) -> tuple[Floats, Flags]:
    """Radiance (height, width, 3) of the floor by paths, and the floor's pixels (height, width) bool.

    `spp` paths start at every pixel's centre, as in the renderer's `qmc`, and end at the triangles that they hit.
    """
    from lambent.baking.engine import engine

    engine()
    from lambent.baking.pictures.tracer import LightMap, Tracer
    from lambent.baking.surfaces.atlas import Atlas
    from lambent.baking.tracing.rays import distances, rays_from
    from lambent.baking.tracing.traced_scene import TracedScene

    shapes, dark = meshes(), (0.0, 0.0, 0.0)
    objects = tuple(
        SceneObject(name, mesh, FLOOR if name == FLOOR else PAINT, LAMP if name == "lamp" else dark)
        for name, mesh in shapes.items()
    )
    materials = {PAINT: Material(name=PAINT, kd=(1, 1, 1)), FLOOR: Material(name=FLOOR, lobes=(lobe,))}
    scene, irradiance = Scene("planar bench", objects, materials, ConstantEnvironment(SKY)), light_map(shapes)
    atlas = Atlas(scene, light_map_places(shapes), irradiance.shape[1], irradiance.shape[0])
    traced = TracedScene(atlas, {}, [False] * len(objects))
    rays = pixel_rays(camera, width, height).reshape(-1, 3)
    eye = np.asarray(camera.position, float)
    to_floor = -eye[1] / np.minimum(rays[:, 1], -1e-9)
    place = eye + rays * to_floor[:, None]
    shown = (rays[:, 1] < 0) & (np.abs(place[:, [0, 2]]).max(axis=1) < REACH)
    shown &= distances(traced.whole(diffuse=False), rays_from(eye, rays)) > to_floor - 1e-3
    light = np.zeros((len(rays), 3), np.float32)
    light[shown] = Tracer.of_baked(traced, LightMap(irradiance)).specular_along(eye, rays[shown], spp, 7, progress)
    return light.reshape(height, width, 3), shown.reshape(height, width)
