"""Rays through the maps of a light field by fixed-point iteration, as through distance impostors.

Szirmay-Kalos, Aszodi, Lazanyi and Premecz 2005, "Approximate ray-tracing on the GPU with distance impostors".
"""

from __future__ import annotations

import numpy as np

from lambent.baked.light_fields.light_field import LightField, Sky
from lambent.baked.light_fields.lookup import March, Marched, Place, combined
from lambent.baked.light_fields.maps import nearness_along
from lambent.core.arrays import Floats


def fixed_point(field: LightField, place: Place, w: Floats, rounds: int = 4, edges: Sky | None = None) -> Marched:
    """`light_field_lookup.marched` by the iteration t = d(x + t w): cheaper than its search, but blind to occluders.

    Surfaces in front of the one that the iteration finds are missed.
    """
    offset, point, known = place.offsets(field), place.named(), place.known
    direction = np.broadcast_to(w[:, None], offset.shape)
    along = np.einsum("kjc,kjc->kj", offset, direction)
    height = np.maximum(np.einsum("kjc,kjc->kj", offset, offset) - along**2, 0)
    q = direction
    for _ in range(rounds):
        d = 1 / np.maximum(nearness_along(field, point, q), 1e-9)
        t = np.sqrt(np.maximum(d**2 - height, 0)) - along  # where the ray leaves the sphere of that radius
        q = offset + np.maximum(t, 1e-9)[..., None] * direction
    rule = March()
    nearness = nearness_along(field, point, q)
    met = known & (np.abs(np.linalg.norm(q, axis=-1) * nearness - 1) < rule.tolerance) & (t > 0)
    open_sky = known & (nearness_along(field, point, direction) == 0) & ~met
    return combined(field, place, w, rule, q, np.where(met, t, np.inf), open_sky, None, edges)
