"""Bounding planes of a probe: a few planes approximate the surfaces it sees (thesis M, 4.4.1).

The distance to these planes corrects look-ups from points away from the probe's centre. A displacement of delta turns
the look-up by about delta |1/t_planes - 1/t|, so planes are added one by one to minimise the mean of
|1/t_planes - 1/t| over the sphere. Candidates are the planes of visible surfaces, and the box around them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats, Indices
from lambent.core.geometry.cubemap import face_directions, texel_solid_angles
from lambent.core.geometry.directions import normalize
from lambent.store.contract import FAR

FEWEST, MOST = 4, 8
WORTH = 0.02  # of the remaining error: an additional plane must remove this share
ANGLE_BINS = 12  # per cube axis, for the histogram of normals
CANDIDATES = 24
CLEARANCE = 0.02  # metres from the centre: nearer planes would turn look-ups wildly


def bounding_planes(distance: Floats, normals: Floats) -> NDArray[np.float32]:
    """Planes (P, 4) (n, d) with n.x + d = 0 relative to the probe's centre, n towards it.

    Parameters
    ----------
    distance : (6, N, N)
        Metres to the hit surface, FAR without a hit.
    normals : (6, N, N, 3)
        Unit normals there, on the side of the centre.
    """
    n = distance.shape[1]
    w = normalize(face_directions(n)).reshape(-1, 3)
    omega = np.broadcast_to(texel_solid_angles(n), (6, n, n)).reshape(-1)
    t, normal = distance.reshape(-1), normals.reshape(-1, 3)
    hit = t < FAR
    if not hit.any():
        return np.zeros((0, 4), np.float32)
    points = w[hit] * t[hit, None]
    candidates = np.concatenate([_dominant(points, normal[hit], omega[hit]), _box(points)])
    inverse = [np.maximum(-(w @ plane[:3]) / plane[3], 0.0) for plane in candidates]  # 1/t, 0 without a hit
    wanted = np.where(hit, 1 / t, 0.0)
    chosen: list[int] = []
    seen = np.zeros_like(wanted)
    error = _error(seen, wanted, omega)
    while len(chosen) < MOST:
        errors = [_error(np.maximum(seen, i), wanted, omega) for i in inverse]
        best = int(np.argmin(errors))
        if best in chosen or (len(chosen) >= FEWEST and errors[best] > (1 - WORTH) * error):
            break
        if len(chosen) < FEWEST and errors[best] >= error:
            break
        chosen.append(best)
        seen, error = np.maximum(seen, inverse[best]), errors[best]
    return candidates[chosen].astype(np.float32)


def _error(inverse: Floats, wanted: Floats, omega: Floats) -> float:
    return float((np.abs(inverse - wanted) * omega).sum())


def _dominant(points: Floats, normals: Floats, omega: Floats) -> Floats:
    """Planes of the surfaces with the largest solid angles, by a histogram over normal and offset, refined."""
    offset = -(points * normals).sum(axis=1)
    major = np.abs(normals).max(axis=1, keepdims=True)
    normal_bin = np.round(normals / major * ANGLE_BINS / 2).astype(int)
    step = max(0.02, 0.02 * float(np.median(np.linalg.norm(points, axis=1))))
    _, group = np.unique(_packed(normal_bin, np.round(offset / step).astype(int)), return_inverse=True)
    weight = np.bincount(group.reshape(-1), omega)
    planes = []
    for g in np.argsort(-weight)[:CANDIDATES]:
        mine = group.reshape(-1) == g
        n = np.average(normals[mine], axis=0, weights=omega[mine])
        n /= np.linalg.norm(n)
        d = -np.average(points[mine] @ n, weights=omega[mine])
        if d > CLEARANCE:
            planes.append([*n, d])
    return np.array(planes).reshape(-1, 4)


def _packed(normal_bin: Indices, step: Indices) -> Indices:
    """One number per bin, in the order of the bins: one key sorts many times faster than rows of four."""
    packed = np.zeros(len(step), np.int64)
    for column in normal_bin.T:
        packed = packed * (ANGLE_BINS + 1) + column + ANGLE_BINS // 2
    return packed * (2 * int(np.abs(step).max()) + 1) + step + int(np.abs(step).max())


def _box(points: Floats) -> Floats:
    """The six sides of the box around the points, n inwards."""
    n = np.stack([np.eye(3), 0.0 - np.eye(3)], axis=1).reshape(6, 3)
    return np.column_stack([n, np.maximum(CLEARANCE, -(points @ n.T).min(axis=0))])
