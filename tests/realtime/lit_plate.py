"""A mirroring plate under a dark ball, in a room that is open above: every pixel's place and ray are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lambent.baked.light_fields.light_field import CANDIDATES, NO_POINT, LightField
from lambent.baked.light_fields.lookup import Place
from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.directions import normalize, reflect
from lambent.core.geometry.octahedral import texel_directions
from lambent.core.views.camera import Camera, image_plane
from lambent.materials.document import Material
from lambent.realtime.light.baked import BakedScene
from lambent.realtime.objects.unbaked import unbaked_scene
from lambent.scenes.geometry import patch
from tests.realtime.lit_ball import HALF, MIRROR, seen
from tests.realtime.lit_wall import cube_of, smooth_light

HEIGHT, EDGE, OFFSET = -0.55, 0.5, 0.04
CAMERA = Camera(name="plate", position=(0.1, 0.25, 0.8), target=(0.0, HEIGHT, 0.0), fov_y_deg=40.0)
GRID = (40, 40)  # of the sample map
NORMAL = np.array([0.0, 1.0, 0.0])


def plate_field(across: int = 8, side: int = 62, dropped: int = 0) -> LightField:
    """across x across points over the plate; from `dropped` texels of the sample map all points are taken."""
    at = (np.arange(across) + 0.5) / across
    u, v = (a.ravel() for a in np.meshgrid(at, at))
    points = on_plate(np.stack([u, v], axis=-1)) + OFFSET * NORMAL
    light, distance = seen(points[:, None, None], texel_directions(side))
    w = texel_directions(side)
    open_above = (points[:, None, None] + distance[..., None] * w)[..., 1] > HALF[1] - 1e-6
    light = np.where(open_above[..., None], smooth_light(w), light)
    rows, columns = GRID
    column, row = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
    texels = on_plate(np.stack([column, row], axis=-1))
    away = np.linalg.norm(points - texels[..., None, :], axis=-1)
    sample_map = np.argsort(away, axis=-1)[..., :CANDIDATES].astype(np.uint16)
    sample_map[3::7, 2::5, 2:] = NO_POINT
    sample_map[:dropped] = NO_POINT
    normals = np.broadcast_to(NORMAL, points.shape)
    return LightField(
        points.astype(np.float32), normals.astype(np.float32), light.astype(np.float16),
        np.where(open_above, 0, 1 / distance).astype(np.float16), sample_map, (0, 0), GRID, OFFSET,
    )  # fmt: skip


def on_plate(uv2: Floats) -> Floats:
    """Places (..., 3) of uv2 (..., 2)."""
    x, z = EDGE * (2 * uv2[..., 0] - 1), EDGE * (1 - 2 * uv2[..., 1])
    return np.stack([x, np.full_like(x, HEIGHT), z], axis=-1)


def plate_scene(field: LightField, material: Material = MIRROR) -> BakedScene:
    mesh = patch((-EDGE, HEIGHT, EDGE), (2 * EDGE, 0, 0), (0, 0, -2 * EDGE))
    uv2 = np.stack([mesh.positions[:, 0] / EDGE + 1, 1 - mesh.positions[:, 2] / EDGE], axis=-1) / 2
    scene = unbaked_scene({"plate": mesh}, material, cube_of(smooth_light))
    return replace(scene, uv2=uv2.astype(np.float32), light_fields={"plate": field})


def mirrored(field: LightField, size: int) -> tuple[Place, Floats, Flags]:
    """Places of all pixels on the plate's plane, the directions they mirror, and which pixels are well on the plate."""
    across, up, forward = image_plane(CAMERA, size, size)
    clip = (np.arange(size) + 0.5) / size * 2 - 1
    x, y = np.meshgrid(clip, -clip)
    w = normalize(forward + x[..., None] * across + y[..., None] * up).reshape(-1, 3)
    eye = np.array(CAMERA.position)
    p = eye + ((HEIGHT - eye[1]) / w[:, 1])[:, None] * w
    uv2 = np.stack([p[:, 0] / EDGE + 1, 1 - p[:, 2] / EDGE], axis=-1) / 2
    n = np.broadcast_to(NORMAL, p.shape)
    inside = ((uv2 > 0.01) & (uv2 < 0.99)).all(axis=1) & (w[:, 1] < -0.15)  # steeper than normals are bent for
    return Place.at(field, p, n, uv2), reflect(-w, n), inside
