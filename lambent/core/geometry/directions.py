"""Directions and angles.

Conventions of the whole project: local frame (t, b, n) with n = +z; unit vectors of shape (..., 3) point away from the
surface; `wi` to the light, `wo` to the viewer; theta from n, phi from t. World space is right-handed, y up, metres.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from lambent.core.arrays import Floats as Floats  # re-exported: most users of directions need the type

FLIP_Z = np.array([1.0, 1.0, -1.0])  # factor that mirrors a direction at the surface
HALF_TURN = np.array([-1.0, -1.0, 1.0])  # factor that turns a direction by 180 degrees about n


def direction(theta_rad: ArrayLike, phi_rad: ArrayLike) -> Floats:
    """Unit vectors (..., 3) in the local frame from spherical angles in radians."""
    theta, phi = np.broadcast_arrays(np.asarray(theta_rad, float), np.asarray(phi_rad, float))
    sin_theta = np.sin(theta)
    return np.stack([sin_theta * np.cos(phi), sin_theta * np.sin(phi), np.cos(theta)], axis=-1)


def angles(w: Floats) -> tuple[Floats, Floats]:
    """(theta, phi) in radians of unit vectors (..., 3); theta in [0, pi], phi in [0, 2 pi).

    theta by atan2, because arccos(z) loses half the digits near the normal.
    """
    return elevation(w), np.arctan2(w[..., 1], w[..., 0]) % (2 * np.pi)


def elevation(w: Floats) -> Floats:
    """theta (...) in radians of directions (..., 3), in [0, pi]."""
    return np.arctan2(np.hypot(w[..., 0], w[..., 1]), w[..., 2])


def raised(w: Floats) -> Floats:
    """Directions (..., 3) on the upper side: those below the surface are mirrored at it."""
    return np.stack([w[..., 0], w[..., 1], np.abs(w[..., 2])], axis=-1)


def normalize(v: Floats) -> Floats:
    """`v` (..., 3) at unit length; the zero vector stays zero."""
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.asarray(np.divide(v, length, out=np.zeros_like(v), where=length > 0))


def half_vector(wi: Floats, wo: Floats) -> Floats:
    """normalize(wi + wo), (..., 3); zero for opposite directions."""
    return normalize(wi + wo)


def reflect(w: Floats, about: Floats) -> Floats:
    """`w` mirrored about the unit axis `about`: 2 (w.a) a - w."""
    return np.asarray(2 * np.sum(w * about, axis=-1, keepdims=True) * about - w)


def basis(n: Floats) -> tuple[Floats, Floats]:
    """Tangents (t, b) that complete unit normals (..., 3) to right-handed frames (Duff et al. 2017, listing 3)."""
    sign = np.where(n[..., 2] >= 0, 1.0, -1.0)
    a = -1.0 / (sign + n[..., 2])
    c = n[..., 0] * n[..., 1] * a
    t = np.stack([1 + sign * n[..., 0] ** 2 * a, sign * c, -sign * n[..., 0]], axis=-1)
    b = np.stack([c, sign + n[..., 1] ** 2 * a, -n[..., 1]], axis=-1)
    return t, b


def rotation_about(axis: Floats, angle_rad: float) -> Floats:
    """(3, 3) right-handed rotation about a unit axis (3,) (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + math.sin(angle_rad) * cross + (1 - math.cos(angle_rad)) * cross @ cross)
