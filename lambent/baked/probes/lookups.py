"""Probe look-ups with parallax: numpy versions of the renderer's shaders, tested for parity.

Points x are relative to the probe's centre, directions w unit. Returned directions need not be unit; they equal w if
the look-up finds nothing on the ray.
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import face_directions, sample

PLANE_ACTIVE_M = 1e-6  # planes closer to x than this, or behind it, are ignored
NEARNESS_MIN = 1e-6  # 1/m: farther planes count as infinitely far
TINY = 1e-9  # guards divisions
# The march through a distance map: its steps, and bounds of the secant's shares.
STEPS = 16
SECANTS = ((0.05, 0.95), (0.05, 0.95), (0.05, 0.95), (0.0, 1.0))
DEPTH_MIN_M = 1e-3


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
    """Directions (n, 3) from the probe's centre to where rays first pass behind its surfaces.

    A distance impostor (Szirmay-Kalos et al. 2005): steps, then the secant method. Steps are equal in s of
    (1 - s) x/|x| + s w, the ray's points as seen from the centre, from its start to infinity: fine where the ray is
    near, whatever the scale of the scene. A ray that starts behind surfaces counts from where it comes out. `inverse`
    is `inverse_depth`.
    """
    reach = np.linalg.norm(x, axis=1)
    start = x / np.maximum(reach, TINY)[:, None]

    def along(s: Floats) -> Floats:
        return np.asarray((1 - s)[:, None] * start + s[:, None] * w)

    def behind(s: Floats) -> Floats:
        q = along(s)
        size = np.abs(q).max(axis=1)
        seen = sample(inverse, np.where(size[:, None] > 0, q, w))[:, 0]
        return np.asarray(reach * size * seen - (1 - s))

    near = np.zeros(len(x))
    f_near = behind(near)
    far, f_far, met = near, f_near, np.zeros(len(x), bool)
    for i in range(STEPS):
        near, f_near = np.where(met, near, far), np.where(met, f_near, f_far)
        far = np.where(met, far, (i + 1) / STEPS)
        f_far = np.where(met, f_far, behind(far))
        met |= (f_near < 0) & (f_far >= 0)
    for low, high in SECANTS:
        s = near + (far - near) * (f_near / np.minimum(f_near - f_far, -TINY)).clip(low, high)
        f = behind(s)
        near, f_near = np.where(f < 0, s, near), np.where(f < 0, f, f_near)
        far, f_far = np.where(f < 0, far, s), np.where(f < 0, f_far, f)
    return np.where(met[:, None], along(s), w)
