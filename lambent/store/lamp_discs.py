"""Directions and light of lamps, in the discs of `store.lamps`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.directions import basis, normalize
from lambent.core.plain import triple
from lambent.scenes.photometry.opening import X, Y, Z
from lambent.scenes.scene import IesLight, PointLight

SIDE = 1024  # texels along a disc: .16 degrees apart for a hemisphere


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


def half_axes_m(lamp: PointLight | IesLight) -> tuple[float, float]:
    """Half axes, across and down in `axes_of`, of the ellipse that a lamp's opening counts as; 0 without an opening.

    A rectangle counts as an ellipse of the same area.
    """
    if isinstance(lamp, PointLight):
        return 0.0, 0.0
    opening = lamp.photometry.opening
    share = 1 / math.sqrt(math.pi) if opening.shape == "box" or opening.axis != Z else 0.5
    return opening.size_m[X] * share, opening.size_m[Y] * share


def opening_of(lamp: PointLight | IesLight) -> dict[str, Any]:
    """What a `LampRecord` says of a luminaire's opening."""
    if isinstance(lamp, PointLight):
        return {}
    opening = lamp.photometry.opening
    silhouettes = triple(opening.projected_m2(np.eye(3)))
    return {"half_axes_m": half_axes_m(lamp), "silhouettes_m2": silhouettes, "is_box": opening.shape == "box"}


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


def directions(reach: float) -> tuple[Floats, Flags]:
    """Directions (SIDE^2, 3) of a shadow map's texels in its lamp's axes, and whether the sphere has them."""
    place = (2 * np.arange(SIDE) + 1) / SIDE - 1
    s = np.stack(np.meshgrid(place, place), axis=-1).reshape(-1, 2) * np.sin(np.radians(reach) / 2)
    square = (s * s).sum(axis=1)
    there = square < 1
    square = np.minimum(square, 1.0)
    return np.column_stack([2 * s * np.sqrt(1 - square)[:, None], 1 - 2 * square]), there
