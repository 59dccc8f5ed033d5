"""Viewers of a scene: their positions, their reach, and the hits of rays from their eyes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lambent.baking.tracing.rays import rays_from
from lambent.baking.tracing.seen.visibility import camera_eyes, viewing_places
from lambent.core.arrays import Floats, Indices
from lambent.scenes.scene import Scene

RAYS = 1 << 18


@dataclass(frozen=True)
class Viewers:
    """Eyes (E, 3) of a scene's viewers, and their reach: nine tenths of their looks end within `reach_m`."""

    eyes: Floats
    reach_m: float


def viewers_of(scene: Scene, traced: Any) -> Viewers | None:
    """Eyes at the cameras and at free places in their view, half each; None without cameras, or if they see nothing.

    Places beyond the cameras' reach are left out, because rays through a window end far outside. `traced` is the
    mi.Scene of the opaque triangles, None without any.
    """
    eyes = camera_eyes(scene)
    if not len(eyes) or traced is None:
        return None
    _, _, distance = met(traced, eyes, RAYS // 16)
    if not len(distance):
        return None
    reach = float(np.quantile(distance, 0.9))
    places = viewing_places(scene, traced)
    places = places[np.linalg.norm(places[:, None] - eyes, axis=2).min(axis=1) < reach]
    return Viewers(np.concatenate([np.resize(eyes, (max(len(places), len(eyes)), 3)), places]), reach)


def met(traced: Any, eyes: Floats, count: int) -> tuple[Floats, Indices, Floats]:
    """Of `count` rays from the eyes, those that hit: directions (M, 3), triangles (M,), distances (M,)."""
    rng = np.random.default_rng(0)
    z, phi = 1 - 2 * rng.random(count), 2 * np.pi * rng.random(count)
    directions = np.stack([np.sqrt(1 - z**2) * np.cos(phi), z, np.sqrt(1 - z**2) * np.sin(phi)], axis=-1)
    found = traced.ray_intersect_preliminary(rays_from(eyes[np.arange(count) % len(eyes)], directions))
    hit = np.flatnonzero(np.array(found.is_valid()))
    return directions[hit], np.array(found.prim_index)[hit].astype(np.int64), np.array(found.t)[hit].astype(float)
