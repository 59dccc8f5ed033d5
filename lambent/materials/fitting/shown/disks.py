"""Disks and in-plane curves of an incident direction, as numbers for the plots and the window.

A disk shows the outgoing hemisphere from above, theta_o from the centre to the rim, turned so that the source is at the
top; the far side is shown in the same azimuths. Its brightness is the cube root of the transfer probability.
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Flags
from lambent.core.geometry.directions import Floats, angles, direction
from lambent.materials.fitting.shown.incidence import Incidence

NEAR_TUPLE = 1.3  # a pixel shows the nearest tuple within this times the distance to its fourth neighbour
LEAST_TUPLES = 8  # fewer on a side make no disk
PLANE_DEG = 3.0  # tuples this close to the plane of incidence belong to its curve
THETA_STEP_DEG = 0.75


def brightness(f: Floats, wo: Floats) -> Floats:
    """(..., C) cube root of the transfer probability, of f (..., C) in 1/sr at wo (..., 3)."""
    return np.asarray(np.cbrt(np.maximum(f, 0) * np.abs(wo[..., 2:])))


def disk_directions(pixels: int, phi_deg: float, far: bool) -> tuple[Floats, Flags]:
    """wo (pixels, pixels, 3) of a disk whose source has azimuth phi_deg, and flags of its pixels; row 0 on top."""
    steps = (np.arange(pixels) + 0.5) / pixels * 2 - 1
    x, y = np.meshgrid(steps, -steps)
    radius = np.hypot(x, y)
    theta = np.where(radius < 1, radius, 1) * np.pi / 2
    phi = np.arctan2(y, x) + np.radians(phi_deg - 90)
    return direction(np.pi - theta if far else theta, phi), radius < 1


def measured_disk(entry: Incidence, far: bool, pixels: int) -> Floats:
    """Brightness (pixels, pixels, C) of the nearest tuple; NaN if none is near or the pixel is off the disk."""
    from scipy.spatial import cKDTree

    wo, inside = disk_directions(pixels, entry.phi_deg, far)
    empty = np.full((pixels, pixels, entry.f.shape[1]), np.nan)
    here = (entry.wo[:, 2] < 0) == far
    if here.sum() < LEAST_TUPLES:
        return empty
    points, first = np.unique(np.round(entry.wo[here], 6), axis=0, return_index=True)  # at theta_i = 0, phi_i repeats
    tree = cKDTree(points)
    even = np.sqrt(2 * np.pi / len(points))  # distance to a neighbour for evenly spaced tuples
    spacing = np.maximum(tree.query(points, k=5)[0][:, -1], even)
    distance, nearest = tree.query(wo.reshape(-1, 3))
    known = (distance <= NEAR_TUPLE * spacing[nearest]).reshape(inside.shape) & inside
    values = brightness(entry.f[here][first], points)[nearest].reshape(empty.shape)
    return np.where(known[..., None], values, np.nan)


def in_plane_directions(theta_i_deg: float, phi_deg: float, signed_deg: Floats, far: bool) -> tuple[Floats, Floats]:
    """wi and wo (N, 3) in the plane of incidence; signed theta_o (N,) is negative on the source's side."""
    theta = np.radians(np.abs(signed_deg))
    wo = direction(np.pi - theta if far else theta, np.radians(phi_deg + np.where(signed_deg > 0, 180, 0)))
    wi = direction(np.radians(theta_i_deg), np.radians(phi_deg))
    return np.broadcast_to(wi, wo.shape), wo


def in_plane_tuples(entry: Incidence, far: bool) -> tuple[Floats, Floats]:
    """Signed theta_o (K,) in degrees from the side's normal, and p (K, C), of the tuples nearest the plane.

    One tuple, the nearest, per `THETA_STEP_DEG`; none further than `PLANE_DEG` from the plane.
    """
    theta, phi = angles(entry.wo)
    off = np.degrees(phi) - entry.phi_deg
    aside_deg = np.degrees(np.arcsin(np.clip(np.sin(theta) * np.abs(np.sin(np.radians(off))), 0, 1)))
    ahead = np.cos(np.radians(off)) <= 0
    signed = np.degrees(np.pi - theta if far else theta) * np.where(ahead, 1, -1)
    usable = np.flatnonzero((aside_deg <= PLANE_DEG) & ((entry.wo[:, 2] < 0) == far))
    nearest_first = usable[np.argsort(aside_deg[usable], kind="stable")]
    _, first = np.unique(np.round(signed[nearest_first] / THETA_STEP_DEG), return_index=True)
    chosen = nearest_first[first]
    return signed[chosen], entry.f[chosen] * np.abs(entry.wo[chosen, 2:])
