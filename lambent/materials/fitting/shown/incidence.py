"""Tuples of a table grouped by incident direction, their disks and in-plane curves, for the plots and the window.

A disk shows the outgoing hemisphere from above, theta_o from the centre to the rim, turned so that the source is at the
top; the far side is shown in the same azimuths. Its brightness is the cube root of the transfer probability.

Unmeasured directions are filled in from mirror-symmetric ones. A surface whose grain runs along x or y is symmetric in
both axes, and under a turn of 180 degrees. An isotropic one, whose tuples are turned to phi_i = 0, is symmetric in the
plane of incidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lambent.core.arrays import Flags
from lambent.core.geometry.directions import Floats, angles, direction
from lambent.materials.measured.protocol import MeasuredSamples

NEAR_TUPLE = 1.3  # a pixel shows the nearest tuple within this times the distance to its fourth neighbour
LEAST_ON_DISK = 8  # tuples of a side
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
    if here.sum() < LEAST_ON_DISK:
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


ALIKE_DEG = 1.0
# Signs of x and y, and the azimuth that phi maps to: sign * phi + offset, in degrees.
MIRRORS = (((1, -1), -1, 0.0), ((-1, 1), -1, 180.0), ((-1, -1), 1, 180.0))


def mirrored(entry: Incidence, entries: Sequence[Incidence]) -> Incidence | None:
    """Tuples of `entries`, mirrored so that their incident direction becomes that of `entry`; None without any."""
    found = []
    for other in entries:
        if abs(other.theta_deg - entry.theta_deg) > ALIKE_DEG:
            continue
        for signs, sign, offset in MIRRORS:
            away = (sign * other.phi_deg + offset - entry.phi_deg + 180) % 360 - 180
            if abs(away) <= ALIKE_DEG or entry.theta_deg < ALIKE_DEG:
                found.append((other.wo * np.array((*signs, 1)), other.f, other.weight))
    if not found:
        return None
    wo, f, weight = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return replace(entry, wo=wo, f=f, weight=weight)


MOST_ANGLES = 12  # more distinct angles than this are grouped in bins
THETA_CENTRES_DEG = np.array([2.5, 15.0, 30.0, 45.0, 60.0, 75.0])
PHI_CENTRES_DEG = np.array([0.0, 90.0, 180.0, 270.0])  # every ring of a Klems basis has patches there
BIN_HALF_WIDTH_DEG = 2.5
ROUND_DEG = 1.0
LEAST_TUPLES = 16


@dataclass(frozen=True)
class Incidence:
    """The tuples of one incident direction.

    Attributes
    ----------
    theta_deg, phi_deg : float
        Of wi; phi is 0 for an isotropic table, whose tuples are turned there.
    wi : (3,)
    wo : (N, 3)
    f : (N, C) in 1/sr
    weight : (N,)
    """

    theta_deg: float
    phi_deg: float
    wi: Floats
    wo: Floats
    f: Floats
    weight: Floats

    def albedo(self, far: bool) -> Floats:
        """Integral (C,) of f |cos theta_o| over the near or the far side; gaps count as the mean of the rest."""
        here = (self.wo[:, 2] < 0) == far
        if not here.any():
            return np.zeros(self.f.shape[1])
        cosine = self.weight[here] * np.abs(self.wo[here, 2])
        return np.asarray(np.pi * (cosine @ self.f[here]) / cosine.sum())


def incidences(samples: MeasuredSamples) -> list[Incidence]:
    """One entry per incident direction with at least 16 tuples, by theta then phi.

    A table without incident directions of its own (MERL, Cornell) is grouped in bins of theta_i.
    """
    theta, phi = angles(samples.wi)
    theta_o, phi_o = angles(samples.wo)
    if samples.info.isotropic:
        phi_o, phi = phi_o - phi, np.zeros_like(phi)
    wo = direction(theta_o, phi_o)
    phi = np.where(theta < np.radians(ROUND_DEG) / 2, 0.0, phi)  # meaningless at the normal
    theta_key, phi_key = _keys(np.degrees(theta), THETA_CENTRES_DEG), _keys(np.degrees(phi), PHI_CENTRES_DEG)
    gathered = []
    for theta_deg in np.unique(theta_key[theta_key >= 0]):
        for phi_deg in np.unique(phi_key[(theta_key == theta_deg) & (phi_key >= 0)]):
            here = (theta_key == theta_deg) & (phi_key == phi_deg)
            if here.sum() >= LEAST_TUPLES:
                wi, f, weight = direction(*np.radians((theta_deg, phi_deg))), samples.f[here], samples.weight[here]
                gathered.append(Incidence(float(theta_deg), float(phi_deg), wi, wo[here], f, weight))
    return gathered


def _keys(angle_deg: Floats, centres_deg: Floats) -> Floats:
    """The key angle of each tuple: the rounded angle if there are few, else its bin's centre or -1."""
    rounded = np.round(angle_deg / ROUND_DEG) * ROUND_DEG % 360
    if len(np.unique(rounded)) <= MOST_ANGLES:
        return rounded
    away = np.abs((angle_deg[:, None] - centres_deg + 180) % 360 - 180)
    nearest = np.argmin(away, axis=1)
    return np.where(away.min(axis=1) <= BIN_HALF_WIDTH_DEG, centres_deg[nearest], -1.0)
