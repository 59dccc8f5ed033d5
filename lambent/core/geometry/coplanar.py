"""Triangles that overlap in one plane, found in compiled loops in near-linear time.

A hierarchical grid (Ericson 2004, "Real-Time Collision Detection", section 7.2.1): triangles of one size class are in
cells of that size; smaller ones are looked up there. Cells are divided by the direction of the normals.
"""

from __future__ import annotations

import numba
import numpy as np

from lambent.core.arrays import MIXERS, Floats, Indices, hashes
from lambent.core.geometry.sequences import cosine_hemisphere, r2
from lambent.core.geometry.triangles import triangle_normals

PARALLEL = float(np.cos(np.radians(2.0)))  # cosine of the angle up to which planes count as parallel
SECTORS = cosine_hemisphere(r2(31)).T.astype(np.float32)  # axes of normals, in no special direction
CLASSES = 48  # of sizes; smaller triangles are in the last


def coplanar_overlaps(corners: Floats, group: Indices, within_m: Floats) -> Indices:
    """Pairs (P, 2) of triangles of different groups that overlap in one plane, whichever way they face.

    Parameters
    ----------
    corners : (F, 3, 3)
        Positions, m.
    group : (F,) int
    within_m : (F,)
        Largest distance of a triangle's corners from the plane of a larger one. Overlaps of at most twice that width
        are touches.
    """
    normals = triangle_normals(corners)
    kind = 2 * group + (normals @ SECTORS[:, 0] > 0)
    same = hashes(corners.reshape(-1, 3)).reshape(-1, 3).sum(axis=1) + kind * MIXERS[0]
    once = np.sort(np.unique(same, return_index=True)[1])  # thousands of copies in one place count as one
    corners, normals, margin = corners[once], normals[once], within_m[once, None]
    boxes = np.stack([corners.min(axis=1) - margin, corners.max(axis=1) + margin], axis=1)
    level = np.ceil(np.log2(np.ptp(boxes, axis=1).max(axis=1))).astype(np.int64)
    level = np.maximum(level, level.max() - CLASSES)
    sector = np.abs(normals.astype(np.float32) @ SECTORS).argmax(axis=1)
    kinds, found = np.stack([sector, group[once], level], axis=1), []
    for one in np.unique(level):
        pairs = _with_class(corners, normals, boxes / 2.0**one, kinds - [0, 0, one], within_m[once])
        found.append(np.unique(pairs[:, 0] * len(once) + pairs[:, 1]))
    return np.asarray(once[np.stack(np.divmod(np.unique(np.concatenate(found)), len(once)), axis=1)])


@numba.njit(cache=True)
def _with_class(corners: Floats, normals: Floats, boxes: Floats, kinds: Indices, within: Floats) -> Indices:
    """Pairs (P, 2) in ascending order of triangles of one size class with others, at most as large; some repeatedly.

    `boxes` (F, 2, 3) are in cells of that class; `kinds` (F, 3) are sector, group, and class relative to this one.
    """
    own = np.flatnonzero(kinds[:, 2] == 0)
    size = 1 << int(np.ceil(np.log2(8 * len(own))))
    first, following = np.full(size, -1), np.empty(8 * len(own), np.int64)
    owner, key = np.empty_like(following), np.empty_like(following)
    count = 0
    cells = np.empty(8, np.int64)
    for large in own:
        for i in range(_cells(boxes[large], kinds[large, 0], cells)):
            place = cells[i] & (size - 1)
            owner[count], key[count], following[count], first[place] = large, cells[i], first[place], count
            count += 1
    found, total = np.empty((64, 2), np.int64), 0
    for f in range(len(corners)):
        if kinds[f, 2] > 0:
            continue
        for i in range(_cells(boxes[f], kinds[f, 0], cells)):
            entry = first[cells[i] & (size - 1)]
            while entry >= 0:
                g = owner[entry]
                is_new = key[entry] == cells[i] and kinds[f, 1] != kinds[g, 1] and (kinds[f, 2] < 0 or f < g)
                if is_new and _overlap(corners[g], normals[g], corners[f], normals[f], within[f]):
                    if total == len(found):
                        found = np.concatenate((found, np.empty_like(found)))
                    found[total, 0], found[total, 1] = min(f, g), max(f, g)
                    total += 1
                entry = following[entry]
    return found[:total]


@numba.njit(cache=True)
def _cells(box: Floats, sector: int, keys: Indices) -> int:
    """Number of cells, up to eight, that a box (2, 3) touches; their keys go into `keys`. Collisions are harmless."""
    count = 0
    for x in range(int(np.floor(box[0, 0])), int(np.floor(box[1, 0])) + 1):
        for y in range(int(np.floor(box[0, 1])), int(np.floor(box[1, 1])) + 1):
            for z in range(int(np.floor(box[0, 2])), int(np.floor(box[1, 2])) + 1):
                mixed = (((x * 31 + sector) * 73856093) ^ (y * 19349663) ^ (z * 83492791)) * 0x2545F4914F6CDD1D
                keys[count] = mixed ^ (mixed >> 29)
                count += 1
    return count


@numba.njit(cache=True)
def _overlap(p: Floats, n: Floats, q: Floats, m: Floats, within: float) -> bool:
    """Whether triangle q (3, 3) of normal m (3,) lies in the plane of triangle p of normal n and overlaps it.

    By separating axes: each reaches by more than twice `within` behind every edge of the other.
    """
    cosine = n[0] * m[0] + n[1] * m[1] + n[2] * m[2]
    if abs(cosine) < PARALLEL:
        return False
    for i in range(3):
        if abs(_along(n, p[0], q[i])) > within:
            return False
    inwards = np.empty(3)
    for a, b, turn in ((p, q, 1.0), (q, p, np.sign(cosine))):
        for i in range(3):
            start, end = a[i], a[(i + 1) % 3]
            for k in range(3):
                j, h = (k + 1) % 3, (k + 2) % 3
                inwards[k] = turn * (n[j] * (end[h] - start[h]) - n[h] * (end[j] - start[j]))
            deepest = max(_along(inwards, start, b[0]), _along(inwards, start, b[1]), _along(inwards, start, b[2]))
            if deepest <= 2 * within * np.sqrt(inwards[0] ** 2 + inwards[1] ** 2 + inwards[2] ** 2):
                return False
    return True


@numba.njit(cache=True)
def _along(n: Floats, a: Floats, b: Floats) -> float:
    """The way from a to b along n, all (3,)."""
    return float(n[0] * (b[0] - a[0]) + n[1] * (b[1] - a[1]) + n[2] * (b[2] - a[2]))
