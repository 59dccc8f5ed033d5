"""Light profiles and shadow maps of lamps at points, in the discs of `store.lamps`."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake.tracing import rays
from lambent.core.arrays import Floats
from lambent.core.geometry.directions import basis, normalize
from lambent.core.light.colour import HALF_MAX
from lambent.scenes.scene import IesLight, PointLight

RADII = 513  # nodes of a profile: .2 degrees apart for a hemisphere
SIDE = 1024  # texels of a shadow map: .16 degrees for a hemisphere
FULL_DEG = 360.0


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


def azimuths(lamp: PointLight | IesLight) -> int:
    """Number of azimuths that a profile needs: 1 for a lamp that shines the same all around."""
    if isinstance(lamp, PointLight) or (np.ptp(np.array(lamp.photometry.candela), axis=0) == 0).all():
        return 1
    return round(FULL_DEG / max(float(np.diff(lamp.photometry.horizontal_deg).min()), 1.0)) + 1


def profile(lamp: PointLight | IesLight, count: int) -> tuple[NDArray[np.float32], Floats]:
    """Intensities (count, RADII) over the largest one, and that in W/sr (3,)."""
    reach = np.radians(reach_deg(lamp))
    theta_deg = np.degrees(2 * np.arcsin(np.linspace(0, 1, RADII) * np.sin(reach / 2)))
    if isinstance(lamp, IesLight):
        phi_deg = np.linspace(0, FULL_DEG, count)[:, None] if count > 1 else np.zeros((1, 1))
        found, scale = lamp.photometry.at(np.minimum(theta_deg, lamp.photometry.vertical_deg[-1]), phi_deg), lamp.scale
    else:
        falloff = max(lamp.outer_deg - lamp.inner_deg, 1e-6)
        share = np.ones(RADII) if lamp.direction is None else ((lamp.outer_deg - theta_deg) / falloff).clip(0, 1)
        found, scale = np.broadcast_to(share, (count, RADII)), lamp.intensity
    most = max(float(found.max()), 1e-30)
    return (found / most).astype(np.float32), np.array(scale) * most


def directions(reach: float) -> tuple[Floats, NDArray[np.bool_]]:
    """Directions (SIDE^2, 3) of a shadow map's texels in its lamp's axes, and whether the sphere has them."""
    place = (2 * np.arange(SIDE) + 1) / SIDE - 1
    s = np.stack(np.meshgrid(place, place), axis=-1).reshape(-1, 2) * np.sin(np.radians(reach) / 2)
    square = (s * s).sum(axis=1)
    there = square < 1
    square = np.minimum(square, 1.0)
    return np.column_stack([2 * s * np.sqrt(1 - square)[:, None], 1 - 2 * square]), there


def shadow_map(scene: Any, lamp: PointLight | IesLight) -> NDArray[np.float16]:
    """(SIDE, SIDE) distances from a lamp to the first surfaces of a mi.Scene that block light; HALF_MAX if none."""
    local, there = directions(reach_deg(lamp))
    world = local @ axes_of(lamp)
    ray = rays.rays_from(np.asarray(lamp.position) + rays.APPROACH * world, world)
    si = rays.intersect(scene, ray, mi.Bool(True), rays.has_holes(scene))
    distance = np.array(dr.select(si.is_valid(), dr.norm(si.p - mi.Point3f(*lamp.position)), dr.inf))
    found = np.where(there, np.minimum(distance, HALF_MAX), HALF_MAX)
    return found.reshape(SIDE, SIDE).astype(np.float16)
