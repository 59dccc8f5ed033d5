"""Which side of an object viewers see: normals of some models point away from them, all over an object."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from lambent.baked.light_fields.nearest_points import Sees
from lambent.baking.light_fields.sampling import spread_evenly
from lambent.baking.probes.selection import viewers_of
from lambent.baking.tracing.rays import towards
from lambent.core.arrays import Flags, Floats
from lambent.scenes.scene import Mesh

POINTS = 256
MORE = 4  # times as much as of the front must be seen of the back


def side_seen(mesh: Mesh, places: Floats, scene: Any, seed: int) -> float:
    """1 where viewers at `places` (m, 3) see a mesh from the side of its normals, or not at all; else -1."""
    rng = np.random.default_rng(seed)
    spots = spread_evenly(mesh, POINTS, rng)
    front, back = (viewers_of(spots.positions, s * spots.normals, places, scene, rng)[0].sum() for s in (1, -1))
    return -1.0 if back > MORE * front else 1.0


def turned_to_viewers(mesh: Mesh, places: Floats, scene: Any, seed: int) -> Mesh:
    """The mesh, its normals and faces turned about where viewers see its other side."""
    if side_seen(mesh, places, scene, seed) > 0:
        return mesh
    return replace(mesh, normals=-mesh.normals, faces=np.ascontiguousarray(mesh.faces[:, ::-1]))


def views_in(scene: Any) -> Sees:
    """Whether nothing of a Mitsuba scene is between places on surfaces and points."""

    def sees(places: Floats, normals: Floats, points: Floats) -> Flags:
        if not len(places):
            return np.zeros(0, bool)
        return ~np.array(scene.ray_test(towards(scene, places, normals, points.astype(float))))

    return sees
