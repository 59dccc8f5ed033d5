"""Probe look-ups with parallax: numpy versions of the renderer's shaders, tested for parity.

Points x are relative to the probe's centre, directions w unit. Returned directions need not be unit; they equal w if
the look-up finds nothing on the ray.
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.cubemap import face_directions, sample
from lambent.core.directions import normalize

PLANE_ACTIVE_M = 1e-6  # planes closer to x than this, or behind it, are ignored
NEARNESS_MIN = 1e-6  # 1/m: farther planes count as infinitely far
# The march through a distance map: number of steps, their growth, the first step relative to the distance seen along w,
# bounds of the secant's shares.
STEPS, GROWTH, FIRST = 12, 1.6, 0.05
SECANTS = ((0.05, 0.95), (0.05, 0.95), (0.05, 0.95), (0.0, 1.0))
DEPTH_MIN_M, INVERSE_MIN = 1e-3, 1e-4


def planes_lookup(x: Floats, w: Floats, planes: Floats) -> Floats:
    """Directions (n, 3) from the probe's centre to the first hit of rays with its bounding planes (P, 4).

    Thesis M, 4.4.1; a plane (n, d) satisfies n.p + d = 0.
    """
    height = x @ planes[:, :3].T + planes[:, 3]
    nearness = np.divide(-(w @ planes[:, :3].T), height, out=np.zeros(height.shape), where=height > PLANE_ACTIVE_M)
    nearness = nearness.max(axis=1, initial=0.0)[:, None]
    return np.where(nearness > NEARNESS_MIN, x + w / np.maximum(nearness, NEARNESS_MIN), w)


def distances_to_planes(w: Floats, planes: Floats) -> Floats:
    """(M,) distances from the probe's centre along unit w (M, 3) to its nearest plane (P, 4); inf without a hit."""
    height = planes[:, 3]
    nearness = np.divide(
        -(w @ planes[:, :3].T), height, out=np.zeros((len(w), len(planes))), where=height > PLANE_ACTIVE_M
    )
    nearest = nearness.max(axis=1, initial=0.0)
    return np.asarray(np.divide(1.0, nearest, out=np.full(len(w), np.inf), where=nearest > NEARNESS_MIN))


def inverse_depth(distance: Floats) -> Floats:
    """(6, N, N, 1) 1/max(|x|, |y|, |z|), 1/m, of points at `distance` (6, N, N); linear across planes."""
    length = np.linalg.norm(face_directions(distance.shape[1]), axis=-1)
    return np.asarray((length / np.clip(distance, DEPTH_MIN_M, None))[..., None])


def distance_lookup(x: Floats, w: Floats, inverse: Floats) -> Floats:
    """Directions (n, 3) from the probe's centre to where rays pass behind its surfaces; `inverse` is `inverse_depth`.

    A distance impostor (Szirmay-Kalos et al. 2005): growing steps, then the secant method.
    """

    def behind(t: Floats) -> Floats:
        p = x + t[:, None] * w
        return np.asarray(np.abs(p).max(axis=1) * sample(inverse, normalize(p))[:, 0] - 1)

    near, f_near = np.zeros(len(x)), np.full(len(x), -1.0)
    far = np.maximum(np.linalg.norm(x, axis=1), FIRST / np.maximum(sample(inverse, w)[:, 0], INVERSE_MIN))
    f_far = behind(far)
    for _ in range(STEPS - 1):
        on = f_far < 0
        near, f_near = np.where(on, far, near), np.where(on, f_far, f_near)
        far = np.where(on, far * GROWTH, far)
        f_far = np.where(on, behind(far), f_far)
    met = f_far >= 0
    for low, high in SECANTS:
        t = near + (far - near) * (f_near / np.minimum(f_near - f_far, -1e-9)).clip(low, high)
        f = behind(t)
        near, f_near = np.where(f < 0, t, near), np.where(f < 0, f, f_near)
        far, f_far = np.where(f < 0, far, t), np.where(f < 0, f_far, f)
    return np.where(met[:, None], x + t[:, None] * w, w)
