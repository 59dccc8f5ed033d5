"""Shading with an offset surface light field: surfaces of any material, and rotated surroundings.

Thesis R, chapter 5: the BRDF draws directions, a look-up of `light_field_lookup` gives their radiance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.light_field import LightField, Sky
from lambent.core.light_field_lookup import POWER, Basis, Place, basis_weights
from lambent.core.light_field_maps import radiance_along
from lambent.core.octahedral import texel_directions

Scatter = Callable[[int], tuple[Floats, Floats]]  # sample number -> w (k, 3) in world space, f cos / pdf (k, 3)


def scattered(scatter: Scatter, look_up: Callable[[Floats], Floats], samples: int) -> Floats:
    """(k, 3) radiance towards the viewer, samples in the outer loop: each sample is looked up in all points (5.12).

    The points' weights follow each direction, so any look-up works.
    """
    total: Floats = np.zeros(1)
    for number in range(samples):
        w, weight = scatter(number)
        total = total + weight * look_up(w)
    return np.asarray(total / samples)


def scattered_by_points(
    field: LightField, place: Place, mirror: Floats, scatter: Scatter, samples: int,
    basis: Basis = "normal", power: int = POWER,
) -> Floats:  # fmt: skip
    """(k, 3) likewise, points in the outer loop: one map is read at a time, and the points' results are blended (5.12).

    The weights use the mirrored direction (k, 3): with B_r the result differs from the other order, with B_n it does
    not.
    """
    weights = basis_weights(field, place, mirror, basis, power)
    total: Floats = np.zeros(place.x.shape)
    for weight, point in zip(weights.T, place.named().T, strict=True):
        total += weight[:, None] * scattered(scatter, partial(radiance_along, field, point), samples)
    return total


def shown(surface: Floats, colour: Floats, reflection: Floats) -> Floats:
    """Radiance (..., 3) of a surface under a coloured mirror (4.12)."""
    return np.asarray(surface + colour * reflection)


def refracted(wo: Floats, n: Floats, eta: float) -> Floats:
    """Directions (k, 3) of rays from the viewer refracted at a surface; wo is unit, eta is inside over outside.

    On total internal reflection, the mirrored direction.
    """
    cosine = np.sum(wo * n, axis=-1, keepdims=True)
    inside = np.where(cosine >= 0, eta, 1 / eta)
    side = np.where(cosine >= 0, 1.0, -1.0)
    square = 1 - (1 - cosine**2) / inside**2
    through = -wo / inside + n * (cosine / inside - side * np.sqrt(np.maximum(square, 0)))
    return np.asarray(np.where(square >= 0, through, 2 * cosine * n - wo))


def turned(sky: Sky, rotation: Floats) -> Sky:
    """The sky rotated by a matrix (3, 3)."""
    return lambda w: sky(w @ rotation)


def under_sky(field: LightField, sky: Sky) -> LightField:
    """The light field with another sky in its maps; light that surfaces received from the old sky stays."""
    n = field.radiance.shape[1]
    behind = sky(texel_directions(n).reshape(-1, 3)).reshape(n, n, 3).astype(field.radiance.dtype)
    radiance = np.where((np.asarray(field.inverse_distance) == 0)[..., None], behind, np.asarray(field.radiance))
    return replace(field, radiance=radiance, blocks=None)  # blocks hold the old sky
