"""Light profiles and shadow maps of lamps at points, in the discs of `store.lamps`."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake.tracing import rays
from lambent.bake.tracing.scene_builder import light_map_texel
from lambent.core.arrays import Floats
from lambent.core.geometry.directions import basis, normalize
from lambent.core.light.colour import HALF_MAX
from lambent.scenes.scene import IesLight, PointLight

SIDE = 1024  # texels along a disc: .16 degrees apart for a hemisphere
MOST_HITS = 16  # surfaces along a ray that may lie in a shadow


def axes_of(lamp: PointLight | IesLight) -> Floats:
    """(3, 3) unit rows, the last one along the axis; straight down for a point light."""
    if isinstance(lamp, IesLight):
        return np.asarray(lamp.axes)
    axis = normalize(np.array(lamp.direction or (0.0, -1.0, 0.0), float))
    return np.array([*basis(axis), axis])


def reach_deg(lamp: PointLight | IesLight) -> float:
    """Angle from its axis beyond which a lamp is dark."""
    if isinstance(lamp, PointLight):
        return 180.0 if lamp.direction is None else lamp.outer_deg
    lit = np.flatnonzero(np.array(lamp.photometry.candela).any(axis=0))
    angles = lamp.photometry.vertical_deg
    return float(angles[min(int(lit[-1]) + 1, len(angles) - 1)]) if len(lit) else float(angles[-1])


def profile(lamp: PointLight | IesLight) -> tuple[NDArray[np.float16], Floats]:
    """Intensities (SIDE, SIDE) over the largest one, and that in W/sr (3,)."""
    local, there = directions(reach_deg(lamp))
    theta_deg = np.degrees(np.arccos(local[:, 2].clip(-1, 1)))
    if isinstance(lamp, IesLight):
        turn_deg = np.degrees(np.arctan2(local[:, 1], local[:, 0]))
        found, scale = lamp.photometry.at(theta_deg, turn_deg), lamp.scale
    else:
        falloff = max(lamp.outer_deg - lamp.inner_deg, 1e-6)
        is_spot = lamp.direction is not None
        found, scale = ((lamp.outer_deg - theta_deg) / falloff).clip(0, 1) if is_spot else there * 1.0, lamp.intensity
    most = max(float(found.max()), 1e-30)
    return (found / most).reshape(SIDE, SIDE).astype(np.float16), np.array(scale) * most


def directions(reach: float) -> tuple[Floats, NDArray[np.bool_]]:
    """Directions (SIDE^2, 3) of a shadow map's texels in its lamp's axes, and whether the sphere has them."""
    place = (2 * np.arange(SIDE) + 1) / SIDE - 1
    s = np.stack(np.meshgrid(place, place), axis=-1).reshape(-1, 2) * np.sin(np.radians(reach) / 2)
    square = (s * s).sum(axis=1)
    there = square < 1
    square = np.minimum(square, 1.0)
    return np.column_stack([2 * s * np.sqrt(1 - square)[:, None], 1 - 2 * square]), there


def shadow_map(
    scene: Any, lamp: PointLight | IesLight, size: tuple[int, int]
) -> tuple[NDArray[np.float16], NDArray[np.bool_]]:
    """Distances (SIDE, SIDE) from a lamp to the first surfaces of a mi.Scene that block light; HALF_MAX for none.

    And the texels (H, W) of a light map of this `size` that lie behind these, in the shadow of at least one ray.
    """
    local, there = directions(reach_deg(lamp))
    world = local @ axes_of(lamp)
    ray = rays.rays_from(np.asarray(lamp.position) + rays.APPROACH * world, world)
    shaded = dr.zeros(mi.UInt32, size[0] * size[1])
    distance = _first_hits(scene, mi.Ray3f(ray), mi.Point3f(*lamp.position), shaded, size[1], size[0],
                           rays.has_holes(scene))  # fmt: skip
    dr.eval(distance, shaded)
    found = np.where(there, np.minimum(np.array(distance), HALF_MAX), HALF_MAX)
    return found.reshape(SIDE, SIDE).astype(np.float16), np.array(shaded).reshape(size) > 0


@dr.syntax
def _first_hits(scene, ray, start, shaded, width, height, holes):  # type: ignore[no-untyped-def]
    """Distances from `start` to the first hits of rays; texels of later hits become 1 in `shaded`."""
    distance = dr.full(mi.Float, dr.inf, dr.width(ray.o))
    active = dr.full(mi.Bool, True, dr.width(ray.o))
    hits = dr.zeros(mi.UInt32, dr.width(ray.o))
    while active & (hits < MOST_HITS):
        si = rays.intersect(scene, ray, active, holes)
        active &= si.is_valid()
        distance = dr.select(active & (hits == 0), dr.norm(si.p - start), distance)
        dr.scatter(shaded, mi.UInt32(1), light_map_texel(si, width, height, active), active & (hits > 0))
        ray = rays.leaving(scene, si.p, si.n, ray.d)
        hits += 1
    return distance
