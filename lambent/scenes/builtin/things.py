"""The things of the built-in scenes: named, placed and painted; and the grain of wood."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.plain import Triple, triple
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import box, merge, placed
from lambent.scenes.scene import IDENTITY, MaterialTextures, Mesh, SceneObject, Texture, UvTransform

POLISHED_SCALE = 0.2  # light map density of bare metal, which has no diffuse term
EARLY, LATE = np.array([0.46, 0.26, 0.115]), np.array([0.185, 0.078, 0.028])  # reflectance within a year's ring


def thing(name: str, material: str, *meshes: Mesh, light_map_scale: float = 1.0) -> SceneObject:
    """A named object of one material, made of any number of meshes."""
    return SceneObject(name, merge(meshes), material, light_map_scale=light_map_scale)


def block(low: Triple, high: Triple, bevel: float = 0.0, brushed: Triple = (1, 0, 0), segments: int = 1) -> Mesh:
    """Box between two corners, in metres."""
    return placed(box(np.subtract(high, low), bevel, brushed, segments), np.add(high, low) / 2)


def at(objects: Sequence[SceneObject], position: Triple, rotation: Floats | None = None) -> list[SceneObject]:
    """`objects` rotated about the origin by a 3x3 matrix, then moved to `position`."""
    return [replace(o, mesh=placed(o.mesh, position, rotation)) for o in objects]


def painted(
    name: str, texels: Floats, *lobes: Lobe, uv_transform: UvTransform = IDENTITY
) -> tuple[Material, MaterialTextures]:
    """A material of diffuse reflectance `texels` (H, W, 3), row 0 on top, under some lobes."""
    mean = texels.mean(axis=(0, 1))
    texture = Texture((texels / mean).astype(np.float16), uv_transform)
    return Material(name=name, kd=triple(mean), lobes=lobes), MaterialTextures(diffuse=texture)


def of_one_colour(mesh: Mesh, u: float, v: float) -> Mesh:
    """`mesh` in the colour that its texture has at one point."""
    return replace(mesh, uv=np.tile(np.array([u, v], np.float32), (len(mesh.positions), 1)))


def wood(height: int = 256, width: int = 512, boards: int = 4) -> Floats:
    """Reflectance (height, width, 3) of boards, their grain along the rows."""
    rng = np.random.default_rng(7)
    u = np.arange(width)[None, :] / width
    v = (np.arange(height)[:, None] + 0.5) / height
    board = np.floor(v * boards)
    own = rng.uniform(size=(3, boards))[:, board.astype(int)]  # of each board: place in the trunk, tone
    rings = 26 * v + 5.0 * own[0] + _waves(rng, u, v, 3, 5, 14) * (0.5 + own[1])
    t = rings - np.floor(rings)
    late = np.clip((t - 0.25) / 0.6, 0, 1) ** 2 * np.clip((1 - t) / 0.08, 0, 1)
    fibres = _waves(rng, u, v, 6, 110, 60)
    mix = np.clip(0.75 * late + 0.09 * fibres + 0.25 * (own[2] - 0.5), 0, 1)[..., None]
    joint = np.abs(v * boards - np.round(v * boards)) < boards / height
    return np.asarray(np.where(joint, 0.45, 1.0)[..., None] * (EARLY + (LATE - EARLY) * mix))


def _waves(rng: np.random.Generator, u: Floats, v: Floats, along: int, across: int, count: int) -> Floats:
    """Smooth periodic noise of standard deviation 1: waves of up to `along` and `across` periods."""
    m, n = rng.integers(-along, along + 1, count), rng.integers(max(1, across // 6), across + 1, count)
    phase = rng.uniform(0, 2 * np.pi, count)
    total = sum(np.cos(2 * np.pi * (m[i] * u + n[i] * v) + phase[i]) for i in range(count))
    return np.asarray(total * np.sqrt(2 / count))
