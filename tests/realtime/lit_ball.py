"""A mirror ball in a room whose walls' light is known, with a light field that is exact at its texels' centres."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baked.light_fields.blocks.blocks import blocks_of, distance_blocks_of
from lambent.baked.light_fields.light_field import CANDIDATES, NO_POINT, LightField
from lambent.baked.light_fields.stored import BLOCKS, DISTANCES
from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.directions import normalize, reflect
from lambent.core.geometry.octahedral import texel_directions
from lambent.core.geometry.sequences import hammersley
from lambent.core.views.camera import Camera, image_plane
from lambent.materials.document import Lobe, Material
from lambent.realtime.light.baked import BakedScene
from lambent.realtime.objects.unbaked import unbaked_scene
from lambent.scenes.geometry import sphere
from lambent.store.contract import light_field_name, write_scene_record
from lambent.store.store import Store
from tests.realtime.lit_wall import cube_of

MIRROR = Material(name="mirror", lobes=(Lobe(mx=0.001, my=0.001, r0=1.0, alpha=0.5),))
HALF = np.array([1.0, 0.7, 0.9])  # half sizes of the room, m
RADIUS, OFFSET = 0.4, 0.03
BALL_LIGHT = 0.05
CAMERA = Camera(name="ball", position=(0.25, 0.3, 0.85), target=(0.0, 0.0, 0.0), fov_y_deg=50.0)


def wall_light(p: Floats) -> Floats:
    """Radiance (..., 3) of the wall at p: each wall has a colour, in soft stripes."""
    relative = p / HALF
    wall = np.abs(relative).argmax(axis=-1)
    sign = np.take_along_axis(relative, wall[..., None], axis=-1)[..., 0] > 0
    colours = np.array(
        [[[1, 0.3, 0.2], [0.2, 0.9, 0.3]], [[0.3, 0.3, 1.0], [2, 2, 1.5]], [[0.9, 0.8, 0.1], [0.6, 0.1, 0.7]]]
    )
    stripes = 1 + 0.5 * np.sin(7 * p[..., 0]) * np.sin(6 * p[..., 1] + 1) * np.cos(5 * p[..., 2])
    return np.asarray(colours[wall, sign.astype(int)] * stripes[..., None])


def seen(p: Floats, w: Floats, *, ball: bool = True) -> tuple[Floats, Floats]:
    """Radiance (..., 3) and distance of what is seen from p along unit w; `ball`: it is there, dark."""
    t = ((np.sign(w) * HALF - p) / np.where(w == 0, 1e-30, w) + np.where(w == 0, np.inf, 0)).min(axis=-1)
    light = wall_light(p + t[..., None] * w)
    b, c = (p * w).sum(axis=-1), (p * p).sum(axis=-1) - RADIUS**2
    root = b * b - c
    t_ball = -b - np.sqrt(np.maximum(root, 0))
    hit = ball & (root > 0) & (t_ball > 0)
    return np.where(hit[..., None], BALL_LIGHT, light), np.where(hit, t_ball, t)


def light_field(count: int = 64, side: int = 126, rows: int = 32) -> LightField:
    """Maps at `count` even points around the ball; the sample map is on the ball's uv."""
    u = hammersley(count)
    z, phi = 1 - 2 * u[:, 1], 2 * np.pi * u[:, 0]
    normals = np.stack([np.sqrt(1 - z * z) * np.cos(phi), z, -np.sqrt(1 - z * z) * np.sin(phi)], axis=-1)
    points = (RADIUS + OFFSET) * normals
    radiance, distance = seen(points[:, None, None], texel_directions(side))
    column, row = np.meshgrid((np.arange(2 * rows) + 0.5) / (2 * rows), (np.arange(rows) + 0.5) / rows)
    theta, around = np.pi * (1 - row), 2 * np.pi * column
    n = np.stack([np.sin(theta) * np.cos(around), np.cos(theta), -np.sin(theta) * np.sin(around)], axis=-1)
    to = points - RADIUS * n[..., None, :]
    away = np.linalg.norm(to, axis=-1)
    above = (to * n[..., None, :]).sum(axis=-1) > np.cos(np.radians(85)) * away
    order = np.argsort(np.where(above, away, np.inf), axis=-1)[..., :CANDIDATES]
    valid = np.take_along_axis(above, order, axis=-1)
    sample_map = np.where(valid, order, NO_POINT).astype(np.uint16)
    return LightField(
        points.astype(np.float32), normals.astype(np.float32), radiance.astype(np.float16),
        (1 / distance).astype(np.float16), sample_map, (0, 0), (rows, 2 * rows), OFFSET,
    )  # fmt: skip


def ball_scene(material: Material = MIRROR, field: LightField | None = None) -> BakedScene:
    """The ball alone: it reflects its light field, and without one a probe at its centre."""
    mesh = sphere(RADIUS, 256, 128)
    probe = cube_of(lambda w: seen(np.zeros(3), w, ball=False)[0], 128)
    scene = unbaked_scene({"ball": mesh}, material, probe)
    fields = {} if field is None else {"ball": field}
    return replace(scene, uv2=np.asarray(mesh.uv, np.float32), light_fields=fields, environment=None)


def mirrored(width: int, height: int) -> tuple[Floats, Flags]:
    """(height, width, 3) light that a perfectly mirroring ball shows the camera, and where the ball is."""
    across, up, forward = image_plane(CAMERA, width, height)
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2)
    w = normalize(forward + x[..., None] * across + y[..., None] * up)
    eye = np.array(CAMERA.position)
    b, c = (eye * w).sum(axis=-1), eye @ eye - RADIUS**2
    root = b * b - c
    p = eye + (-b - np.sqrt(np.maximum(root, 0)))[..., None] * w
    n = normalize(p)
    return seen(p, reflect(-w, n), ball=False)[0], root > 0


def put_ball(folder: Path, field: LightField) -> Store:
    """A store of the ball, in units of 2 W/(sr m^2)."""
    scene = ball_scene(field=field)
    store = Store.create(folder, {})
    arrays = {name: getattr(scene, name) for name in ("positions", "normals", "tangents", "uv", "uv2", "faces")}
    for name, array in arrays.items():
        store.put(f"geometry/{name}", "geometry", array, key="k")
    store.put(
        "probe/ball/radiance",
        "probe",
        scene.probes["ball"].radiance / 2,
        key="k",
        meta={"centre": [0, 0, 0], "unit": 2},
    )
    parts: dict[str, tuple[NDArray[Any], dict[str, Any]]] = {
        "points": (field.points, {}),
        "normals": (field.normals, {}),
        BLOCKS: (blocks_of(field.radiance / np.float16(2)), {"unit": 2.0}),
        DISTANCES: (
            distance_blocks_of(field.inverse_distance, field.cover),
            {"texels": [field.inverse_distance.shape[1]]},
        ),
        "sample_map": (
            field.sample_map,
            {"corner": list(field.corner), "grid": list(field.grid), "offset_m": field.offset_m},
        ),
    }
    for part, (array, meta) in parts.items():
        store.put(light_field_name("ball", part), "light_field", array, key="k", meta=meta)
    write_scene_record(store, scene.record.model_copy(update={"cameras": (CAMERA,)}))
    return store
