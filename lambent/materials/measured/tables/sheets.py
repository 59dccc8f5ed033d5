"""f of one incident direction on one side: a grid of outgoing directions about any pole, or a scattered set.

Directions are in the frame of their side: z is the side's own normal, so that light transmitted straight through at
normal incidence has z = 1, and phi runs from t towards b on either side.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.directions import HALF_TURN, angles, direction
from lambent.core.geometry.sequences import r2
from lambent.materials.measured.protocol import too_negative
from lambent.materials.measured.tables.table import bracket, fill_holes, sensible

LookUp = Callable[[Floats], Floats]
_IN_PLANE = 1e-3  # radians: directions closer to a plane through the pole count as in it
_LEAST_TRIANGULATED = 4
_WEIGHT_POINTS = (1 << 12, 1 << 16)
_HEAVIEST = 4.0  # multiple of the median weight: a tuple at a gap or at the rim does not represent everything beyond


@dataclass(frozen=True)
class Sheet:
    """A grid of outgoing directions.

    Attributes
    ----------
    theta_deg : (T,) increasing, from 0
        From the grid's pole, by default the side's normal; at most 90 about the normal, at most 180 about another pole.
    phi_deg : (P,) increasing in [0, 360)
        One turn, spaced as measured.
    f : (T, P, C)
        1/sr; NaN where not measured; negative as read. Nodes below the horizon are never used.
    frame : (3, 3), optional
        Orthonormal rows: the directions of phi = 0 and phi = 90 from the pole, and the pole.
    images : (T, P) bool, optional
        Nodes that duplicate another: across the plane of incidence if only one side was measured, or along the pole.
    """

    theta_deg: Floats
    phi_deg: Floats
    f: Floats
    frame: Floats | None = None
    images: Flags | None = None

    @property
    def measured(self) -> Flags:
        """(T P,) the nodes with a reading of their own."""
        return np.ones(self.f.shape[:2], dtype=bool).ravel() if self.images is None else ~self.images.ravel()

    @cached_property
    def directions(self) -> Floats:
        """(T P, 3) directions of the nodes, phi fastest."""
        grid = np.radians(np.meshgrid(self.theta_deg, self.phi_deg, indexing="ij"))
        w = direction(*grid).reshape(-1, 3)
        return w if self.frame is None else np.asarray(w @ self.frame)

    @property
    def values(self) -> Floats:
        """(T P, C) f of `directions`, NaN below the horizon as well."""
        f = self.f.reshape(len(self.directions), -1)
        return f if self.frame is None else np.where(self.directions[:, 2:] > 0, f, np.nan)

    @cached_property
    def _whole(self) -> Floats:
        """(T, P + 1, C) with holes filled, the first column repeated at the end."""
        f = self.values.reshape(self.f.shape)
        usable = _usable(self.values, self.directions).reshape(f.shape[:2])
        filled = fill_holes(f, usable, periodic_axis=1) if usable.any() else np.zeros_like(f)
        return np.concatenate([filled, filled[:, :1]], axis=1)

    def at(self, w: Floats, *, about_light: bool = False) -> Floats:
        """f (N, C) of directions (N, 3), bilinear, negative as read; beyond the grid's theta, the last ring is used."""
        theta, phi = angles(w if self.frame is None else w @ self.frame.T)
        t, t1, u = bracket(self.theta_deg, np.degrees(theta))
        turn = np.append(self.phi_deg, self.phi_deg[0] + 360)
        p, p1, v = bracket(turn, (np.degrees(phi) - turn[0]) % 360 + turn[0])
        u, v, f = u[:, None], v[:, None], self._whole
        low, high = f[t, p] * (1 - v) + f[t, p1] * v, f[t1, p] * (1 - v) + f[t1, p1] * v
        return np.asarray(low * (1 - u) + high * u)

    def weights(self) -> Floats:
        """(T P,) solid angles in sr of the nodes' cells, which tile the grid; images add theirs to their originals."""
        theta, turn = np.radians(self.theta_deg), np.radians(np.append(self.phi_deg, self.phi_deg[0] + 360))
        half = np.diff(theta) / 2 if len(theta) > 1 else np.array([np.pi])
        edges = np.concatenate([theta[:1] - half[:1], theta[:-1] + half[: len(theta) - 1], theta[-1:] + half[-1:]])
        rings = -np.diff(np.cos(edges.clip(0, np.pi / 2 if self.frame is None else np.pi)))
        widths = np.diff(turn)
        weight = np.outer(rings, (widths + np.roll(widths, 1)) / 2)
        if self.images is None or not self.images.any():
            return weight.ravel()
        moved = np.where(self.images, weight, 0)
        weight = weight - moved
        if (~self.images[0]).sum() == 1:
            weight[0, ~self.images[0]] += moved[0].sum()
            moved[0] = 0
        mirrored = np.argmin(np.abs((360 - self.phi_deg[:, None]) % 360 - self.phi_deg), axis=1)
        for column in np.flatnonzero(moved.any(axis=0)):
            weight[:, mirrored[column]] += moved[:, column]
        return weight.ravel()


@dataclass(frozen=True)
class ScatteredSheet:
    """Outgoing directions without a grid, usually a scan in the plane of incidence.

    Attributes
    ----------
    directions : (N, 3)
    values : (N, C)
        1/sr; NaN where it was not measured; negative as the sensor read.
    specular : (3, 3)
        `specular_frame` of the incident direction.
    images : (N,) bool
        Mirror images of directions across the plane of incidence, where only one side was measured.
    """

    directions: Floats
    values: Floats
    specular: Floats
    images: Flags

    @property
    def measured(self) -> Flags:
        """(N,) whether each direction was measured, that is, is not a mirror image."""
        return ~self.images

    @cached_property
    def _lookup(self) -> LookUp:
        return self._lookup_about(self.specular)

    @cached_property
    def _lookup_about_light(self) -> LookUp:
        return self._lookup_about(self.specular * HALF_TURN)

    def _lookup_about(self, frame: Floats) -> LookUp:
        usable = _usable(self.values, self.directions)
        w, f = self.directions[usable], self.values[usable]
        if len(w) == 0:
            return lambda asked: np.zeros((len(asked), f.shape[1]))
        if np.abs(w @ self.specular[1]).max() < _IN_PLANE:
            return _plane_scan(w, f, frame)
        return _triangulated(w, f)

    def at(self, w: Floats, *, about_light: bool = False) -> Floats:
        """f (N, C) of directions (N, 3), negative as read.

        A scan in the plane of incidence is looked up by the angle from the mirror direction, or from the light; between
        the half planes the lobe is assumed rotationally symmetric about it. Other sets are interpolated linearly over
        the triangles of their directions; beyond them, the nearest is used.
        """
        return (self._lookup_about_light if about_light else self._lookup)(w)

    def weights(self) -> Floats:
        """(N,) the part of the hemisphere nearest to each direction, in sr; mirror images count for the original."""
        from scipy.spatial import cKDTree

        count = int(np.clip(16 * len(self.directions), *_WEIGHT_POINTS))
        u = r2(count)
        nearest = cKDTree(self.directions).query(direction(np.arccos(u[:, 0]), 2 * np.pi * u[:, 1]))[1]
        share = np.bincount(nearest, minlength=len(self.directions)) * (2 * np.pi / count)
        share = share.clip(np.pi / count, max(_HEAVIEST * float(np.median(share)), 1e-6))
        aside = np.abs(self.directions @ self.specular[1]) > _IN_PLANE
        return share * np.where(aside & self.images.any(), 2.0, 1.0)


def _usable(f: Floats, w: Floats) -> Flags:
    """(N,) whether values (N, C) are readings: possible values, and not marks below zero."""
    possible = sensible(f)
    return np.asarray(possible & ~too_negative(f, w, possible))


def _plane_scan(w: Floats, f: Floats, frame: Floats) -> LookUp:
    """Look-up in a scan of the plane of incidence."""
    nodes, order = np.unique(np.arctan2(w @ frame[0], w @ frame[2]), return_index=True)

    def along(angle: Floats) -> Floats:
        return np.stack([np.interp(angle, nodes, channel) for channel in f[order].T], axis=-1)

    def look_up(asked: Floats) -> Floats:
        from_pole, aside = angles(asked @ frame.T)
        share = ((1 + np.cos(aside)) / 2)[:, None]
        return np.asarray(share * along(from_pole) + (1 - share) * along(-from_pole))

    return look_up


def _triangulated(w: Floats, f: Floats) -> LookUp:
    """Linear look-up over the Delaunay triangles of the directions in the plane theta (cos phi, sin phi)."""
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import QhullError, cKDTree

    tree = cKDTree(w)
    try:
        inside = LinearNDInterpolator(_flat(w), f) if len(w) >= _LEAST_TRIANGULATED else None
    except QhullError:  # directions on one line, or all equal: use the nearest
        inside = None

    def look_up(asked: Floats) -> Floats:
        nearest = f[tree.query(asked)[1]]
        value = np.nan if inside is None else np.asarray(inside(_flat(asked)))
        return np.asarray(np.where(np.isfinite(value), value, nearest))

    return look_up


def _flat(w: Floats) -> Floats:
    theta, phi = angles(w)
    return np.stack([theta * np.cos(phi), theta * np.sin(phi)], axis=-1)


def specular_frame(theta_i_deg: float, phi_i_deg: float) -> Floats:
    """(3, 3) frame about the mirror direction of wi; its x points towards the normal, its y is counter-clockwise.

    For the far side, whose directions are mirrored to the near one, it is the frame about undeviated transmission.
    """
    theta, phi = np.radians(theta_i_deg), np.radians(phi_i_deg)
    back = np.array([np.cos(phi), np.sin(phi), 0.0])
    normal = np.array([0.0, 0.0, 1.0])
    x, pole = np.cos(theta) * back + np.sin(theta) * normal, np.cos(theta) * normal - np.sin(theta) * back
    return np.stack([x, np.cross(pole, x), pole])
