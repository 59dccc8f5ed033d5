"""The scenes of the real-time benches, in memory: a few shapes under an environment, with no other light."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from lambent.core.cubemap import face_directions
from lambent.core.frames import normalize
from lambent.materials.document import Material
from lambent.realtime.baked import BakedScene, Probe
from lambent.scenes.geometry import merge, patch, placed, sphere, tube
from lambent.scenes.scene import Mesh
from lambent.store.contract import CameraRecord, ObjectRecord, SceneRecord, Triple

Floats = NDArray[np.floating]


def torus(radius: float, thickness: float, around: int, section: int) -> Mesh:
    """Torus about the y axis, brushed along its length."""
    phi = 2 * np.pi * np.arange(24) / 24
    points = radius * np.stack([np.cos(phi), 0 * phi, np.sin(phi)], axis=-1)
    return tube(points, thickness, around=section, rows=around // 24, closed=True)


def sphere_and_torus(detail: int = 96) -> dict[str, Mesh]:
    """A sphere in a tilted torus: every normal, curvature of both signs. `detail`: steps round the torus."""
    tilt = np.array([[1, 0, 0], [0, np.cos(0.9), -np.sin(0.9)], [0, np.sin(0.9), np.cos(0.9)]])
    ring = torus(1.0, 0.24, around=detail, section=detail // 2)
    return {"sphere": sphere(0.62, around=detail, rows=detail // 2), "torus": placed(ring, rotation=tilt)}


CAMERA = CameraRecord(name="front", position=(0.0, 0.0, 4.2), target=(0.0, 0.0, 0.0), fov_y_deg=36.0)


def wall(width: float, height: float) -> dict[str, Mesh]:
    """A rectangle at z = 0 that faces +z, centred at the origin."""
    return {"wall": patch((-width / 2, -height / 2, 0), (width, 0, 0), (0, height, 0))}


def baked_scene(
    meshes: Mapping[str, Mesh],
    material: Material,
    environment: Floats,
    planes: Floats | None = None,
    distance: Floats | None = None,
    irradiance: Triple = (0.0, 0.0, 0.0),
) -> BakedScene:
    """All `meshes` in one material, each with a probe at the origin that sees `environment` (6, N, N, 3)."""
    whole, records, first = merge(meshes.values()), [], 0
    for name, mesh in meshes.items():
        low, high = mesh.bounds
        records.append(
            ObjectRecord(
                name=name, material=material.name, first_face=first, face_count=len(mesh.faces),
                bounds=(_triple(low), _triple(high)), probe=True,
            )
        )  # fmt: skip
        first += len(mesh.faces)
    low, high = whole.bounds
    record = SceneRecord(
        name="bench", objects=tuple(records), materials={material.name: material}, cameras=(CAMERA,),
        bounds=(_triple(low), _triple(high)),
    )  # fmt: skip
    probe = Probe((0.0, 0.0, 0.0), environment, distance, np.zeros((0, 4), np.float32) if planes is None else planes)
    return BakedScene(
        record, whole.positions, whole.normals, whole.tangents, np.full((len(whole.positions), 2), 0.5, np.float32),
        whole.faces, np.full((4, 4, 3), irradiance, np.float32), None, environment, dict.fromkeys(meshes, probe),
    )  # fmt: skip


def _triple(v: Floats) -> Triple:
    return float(v[0]), float(v[1]), float(v[2])


def studio(n: int = 256) -> Floats:
    """Environment (6, n, n, 3): dim ceiling and floor, one large, one small and one coloured area light."""
    w = normalize(face_directions(n))
    light = 0.08 + 0.12 * np.clip(w[..., 1:2], 0, 1) * np.array([0.7, 0.85, 1.0])
    light = light + 0.05 * (w[..., 1:2] < -0.2) * np.array([1.0, 0.8, 0.6])
    for towards, wide, high, radiance in (
        ((-0.6, 0.5, 0.7), 0.25, 0.4, (6, 6, 6)),
        ((0.8, 0.3, 0.5), 0.06, 0.06, (60, 52, 40)),
        ((0.2, -0.1, -1.0), 0.9, 0.1, (1.0, 2.0, 4.0)),
    ):
        axis = normalize(np.array(towards, float))
        right = normalize(np.cross(axis, [0, 1, 0]))
        up = np.cross(right, axis)
        front = np.maximum(w @ axis, 1e-6)
        inside = (w @ axis > 0) & (np.abs(w @ right) < wide * front) & (np.abs(w @ up) < high * front)
        light = np.where(inside[..., None], np.array(radiance, float), light)
    return np.asarray(light, np.float32)


def night(n: int = 256) -> Floats:
    """Environment (6, n, n, 3): a row of small bright lamps in the dark, the hardest case for few samples."""
    w = normalize(face_directions(n))
    light = 0.02 + 0.03 * (w[..., 1:2] < 0) * np.array([1.0, 1.0, 1.0])
    for k in range(9):
        phi, height = 2 * np.pi * k / 9, 0.25 + 0.2 * np.sin(5.0 * k)
        axis = normalize(np.array([np.cos(phi), height, np.sin(phi)]))
        colour = 0.5 + 0.5 * np.cos(k + np.array([0.0, 2.0, 4.0]))
        light = np.where((w @ axis > np.cos(0.05))[..., None], 80 * colour, light)
    return np.asarray(light, np.float32)


def dusk(n: int = 256) -> Floats:
    """Environment (6, n, n, 3): a smooth sky over a checkered floor, no lamps."""
    w = normalize(face_directions(n))
    height = w[..., 1:2]
    sky = np.exp(-3 * np.clip(height, 0, 1)) * np.array([1.2, 0.6, 0.3]) + np.array([0.1, 0.15, 0.35])
    down = np.maximum(-height, 1e-3)
    squares = np.sign(np.sin(3 * w[..., :1] / down) * np.sin(3 * w[..., 2:] / down)) * np.clip(4 * down, 0, 1)
    return np.asarray(np.where(height > 0, sky, 0.25 + 0.15 * squares), np.float32)


def from_lat_long(image: Floats, n: int = 256) -> Floats:
    """Environment (6, n, n, 3) of a lat-long picture (H, W, 3): top +y, middle column -z; means over 3x3 samples."""
    height, width = image.shape[:2]
    total = np.zeros((6, n, n, 3))
    fine = face_directions(3 * n).reshape(6, n, 3, n, 3, 3)
    for i in range(3):
        for j in range(3):
            w = normalize(fine[:, :, i, :, j])
            column = (np.arctan2(w[..., 0], -w[..., 2]) / (2 * np.pi) + 0.5) * width
            row = np.arccos(np.clip(w[..., 1], -1, 1)) / np.pi * height
            total += image[np.clip(row.astype(int), 0, height - 1), column.astype(int) % width]
    return (total / 9).astype(np.float32)
