"""Offset surface light fields as thesis R draws them: maps of near points, read along w itself and blended.

Chapters 3 and 4. They err where surroundings are near: the ray from x meets them elsewhere than the ray from a point.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from lambent.baked.light_fields.light_field import LightField
from lambent.baked.light_fields.lookup import POWER, Place, cosine_weights
from lambent.baked.light_fields.maps import nearness_along, radiance_along
from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.directions import normalize

Basis = Literal["nearest", "angle", "average", "reflection", "normal"]
CONES_DEG = (65.0, 75.0)  # half angles about the normal of the cones tried in order for a point
SURFACE_TOLERANCE = 0.15  # relative to the distance at which a point sees the surface


def basis_weights(field: LightField, place: Place, w: Floats, basis: Basis, power: int = POWER) -> Floats:
    """(k, 4) weights B_j, of sum 1, of the points near a place; all 0 without points (4.5, 4.9 to 4.11).

    `w` (k, 3) is unit; `power` is the exponent N of cosines about w ("reflection") or the normal.
    """
    known = place.known
    if basis in ("reflection", "normal"):
        return cosine_weights(field, place, w if basis == "reflection" else place.n, power)
    if basis == "average":
        return np.asarray(known / np.maximum(known.sum(axis=1, keepdims=True), 1))
    if basis == "nearest":
        return np.where(known & (np.cumsum(known, axis=1) == 1), 1.0, 0.0)
    cosine = np.where(known, np.einsum("kjc,kc->kj", normalize(-place.offsets(field)), w), -np.inf)
    return np.where(known & (np.arange(known.shape[1]) == cosine.argmax(axis=1)[:, None]), 1.0, 0.0)


def surface(field: LightField, place: Place) -> tuple[Floats, Flags]:
    """Radiance (k, 3) of the surface itself, and whether a point sees it, (k,) (3.11).

    The result comes from the nearest point that lies in a cone about the normal and sees the surface at x: first in the
    narrow cone, then in the wider one, then anywhere. If none sees it, the light of the nearest is returned.
    """
    offset, point, known = place.offsets(field), place.named(), place.known
    distance = np.linalg.norm(offset, axis=-1)
    cosine = -np.einsum("kjc,kc->kj", offset, place.n) / np.maximum(distance, 1e-12)
    down = np.where(distance[..., None] > 0, offset, -place.n[:, None])
    sees = np.asarray(known & (np.abs(distance * nearness_along(field, point, down) - 1) < SURFACE_TOLERANCE))
    rank = np.zeros(known.shape)
    for cone_deg in CONES_DEG:
        rank += cosine < np.cos(np.radians(cone_deg))
    rank = np.where(sees, rank, 3.0) + np.where(known, 0.0, 4.0)
    best = rank.argmin(axis=1)[:, None]
    chosen = np.take_along_axis(point, best, axis=1)[:, 0]
    light = radiance_along(field, chosen, np.take_along_axis(down, best[..., None], axis=1)[:, 0])
    found = np.asarray(known.any(axis=1))
    return np.where(found[:, None], light, 0.0), np.take_along_axis(sees, best, axis=1)[:, 0]
