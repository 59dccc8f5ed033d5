"""Scenes of the visibility bench: simple shapes, a smooth animal, dominos and a plant, each with its own light.

They are modelled on the pictures of Ben-Artzi 2007 (figures 8.2, 8.7 and 8.9), whose files were not published.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lambent.bench.scenes.specular_scene import torus
from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import face_directions, texel_solid_angles
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.triangles import area_vectors
from lambent.core.plain import Triple
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.scenes.geometry import box, build, cylinder, grid, lathe, merge, patch, placed, sphere, tube, turn
from lambent.scenes.scene import Mesh, Scene, SceneObject
from lambent.scenes.sky.environments import daylight, dusk, night, studio
from lambent.scenes.sky.triangle_lights import TriangleLights, environment_triangles

CHALK = Material(name="chalk", kd=(0.6, 0.6, 0.6))
FLOOR = patch((-40, 0, 40), (80, 0, 0), (0, 0, -80))
TEXELS = 64  # of an edge of an environment


@dataclass(frozen=True)
class Case:
    """Objects on a floor that fills the picture, with an environment (6, n, n, 3)."""

    meshes: Callable[[], dict[str, Mesh]]
    camera: Camera
    environment: Callable[[int], Floats]

    def scene(self) -> Scene:
        objects = (SceneObject(name, mesh, CHALK.name) for name, mesh in {"floor": FLOOR, **self.meshes()}.items())
        return Scene("visibility bench", tuple(objects), {CHALK.name: CHALK})

    def lights(self, count: int) -> TriangleLights:
        w = normalize(face_directions(TEXELS)).reshape(-1, 3)
        weight_sr = np.broadcast_to(texel_solid_angles(TEXELS), (6, TEXELS, TEXELS)).ravel()
        return environment_triangles(w, weight_sr, self.environment(TEXELS).reshape(-1, 3).astype(float), count)


def shapes() -> dict[str, Mesh]:
    """Torus, cone, ball, box and cylinder."""
    cone = lathe([[(0, 0), (0.55, 0)], [(0.55, 0), (0, 1.3)]], around=256)
    return {
        "torus": placed(torus(0.62, 0.2, around=288, section=128), (-0.95, 0.83, 0.0), turn("x", 62)),
        "cone": placed(cone, (0.75, 0, -0.85)),
        "ball": placed(sphere(0.42, 256, 128), (0.95, 0.42, 0.55)),
        "box": placed(box((0.6, 0.6, 0.6)), (-0.3, 0.3, 1.15), turn("y", 28)),
        "cylinder": placed(cylinder(0.22, 0.9, 256), (-0.35, 0, -1.25)),
    }


BLOBS = (  # centre and half axes, metres
    ((0, 0.52, 0), (0.62, 0.5, 0.48)), ((0.1, 0.3, 0), (0.66, 0.3, 0.52)), ((-0.55, 0.95, 0), (0.3, 0.27, 0.26)),
    ((-0.46, 1.38, 0.13), (0.09, 0.38, 0.07)), ((-0.36, 1.34, -0.17), (0.09, 0.38, 0.07)),
    ((-0.45, 0.16, 0.24), (0.3, 0.14, 0.13)), ((-0.45, 0.16, -0.24), (0.3, 0.14, 0.13)),
    ((0.42, 0.2, 0.4), (0.36, 0.19, 0.15)), ((0.42, 0.2, -0.4), (0.36, 0.19, 0.15)),
    ((0.78, 0.42, 0), (0.17, 0.17, 0.17)),
)  # fmt: skip


def animal() -> dict[str, Mesh]:
    """A long-eared animal with furrows, a ball and a column."""
    return {
        "animal": merge(_furrowed(np.array(centre), np.array(axes)) for centre, axes in BLOBS),
        "ball": placed(sphere(0.3, 192, 96), (-0.9, 0.3, 0.95)),
        "column": placed(cylinder(0.2, 1.2, 192), (0.95, 0, -1.0)),
    }


def _furrowed(centre: Floats, axes: Floats) -> Mesh:
    """An ellipsoid with proportionally deep furrows."""
    ball = sphere(1.0, 256, 128)
    x, y, z = np.asarray(ball.positions, float).T
    bumps = np.sin(7 * x + 2 * y) * np.sin(6 * y + 1) * np.sin(8 * z + 2 * x)
    positions = centre + ball.positions * axes * (1 + 0.05 * bumps[:, None])
    across = area_vectors(positions[ball.faces])
    normals = np.zeros_like(positions)
    np.add.at(normals, ball.faces, across[:, None])
    return build(positions, normals, (1, 0, 0), ball.uv, ball.faces)


def dominos() -> dict[str, Mesh]:
    """Dominos along an S, the first one falling."""
    stone, found = box((0.5, 1.0, 0.15)), {}
    s = np.linspace(-1, 1, 2001)
    x, z = 2.2 * s, 1.3 * np.sin(2.6 * s)
    along = np.concatenate([[0], np.cumsum(np.hypot(np.diff(x), np.diff(z)))])
    for i, at in enumerate(np.arange(0, along[-1], 0.4)):
        here, ahead = (np.array([np.interp(at + d, along, c) for c in (x, z)]) for d in (-0.01, 0.01))
        lean = turn("x", max(0.0, 64 - 16 * i))
        lowest = float((stone.positions @ lean.T)[:, 1].min())
        yaw_deg = float(np.degrees(np.arctan2(*(ahead - here))))
        found[f"domino_{i}"] = placed(stone, (here[0], -lowest, here[1]), turn("y", yaw_deg) @ lean)
    return found


def plant() -> dict[str, Mesh]:
    """A pot of forty stems with leaves."""
    random = np.random.default_rng(8)
    stems, leaves = [], []
    for _ in range(40):
        yaw, reach, height = random.uniform(0, 2 * np.pi), random.uniform(0.25, 1.0), random.uniform(0.5, 1.3)
        t = np.linspace(0, 1, 5)[:, None]
        out = np.array([np.cos(yaw), 0, np.sin(yaw)])
        line = [0, 0.5, 0] + out * (0.08 + reach * t**1.6) + np.array([0, 1, 0]) * height * np.sin(1.9 * t)
        stems.append(tube(line, 0.008, 8))
        for share in np.linspace(0.35, 1, 7):
            at = np.array([np.interp(share, t[:, 0], c) for c in line.T])
            aim = turn("y", float(random.uniform(0, 360))) @ turn("z", float(random.uniform(-50, 30)))
            leaves.append(placed(_leaf(float(random.uniform(0.2, 0.34))), at, aim))
    rim = np.array([(0, 0), (0.28, 0), (0.4, 0.52), (0.36, 0.52), (0, 0.45)])
    pot = [rim[i : i + 2] for i in range(4)]
    return {"pot": lathe(pot, around=128), "stems": merge(stems), "leaves": merge(leaves)}


def _leaf(length: float) -> Mesh:
    """A bent leaf along x, creased in the middle."""
    t, s = np.meshgrid(np.linspace(0, 1, 13), np.linspace(-1, 1, 7), indexing="ij")
    wide = 0.28 * length * np.sin(np.pi * np.clip(t, 0.02, 0.98)) ** 0.8
    x, y, z = length * t, length * (0.25 * t - 0.5 * t**2) + 0.35 * wide * np.abs(s), wide * s
    positions = np.stack([x, y, z], axis=-1)
    normals = np.cross(np.gradient(positions, axis=1), np.gradient(positions, axis=0))
    return grid(positions, normals, (1, 0, 0), np.stack([t, s], axis=-1))


def _camera(position: Triple, height: float) -> Camera:
    return Camera("bench", position, (0.0, height, 0.0), fov_y_deg=38.0)


CASES = {
    "shapes": Case(shapes, _camera((0.4, 4.3, 4.2), 0.35), night),
    "bunny": Case(animal, _camera((-1.6, 3.2, 3.9), 0.55), studio),
    "plant": Case(plant, _camera((0.6, 3.4, 4.2), 0.85), dusk),
    "dominos": Case(dominos, _camera((0.3, 4.8, 4.4), 0.2), daylight),
}
