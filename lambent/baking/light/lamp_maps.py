"""Shadow maps of lamps, in the discs of `store.lamps`."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.tracing import rays
from lambent.baking.tracing.scene_builder import light_map_texel
from lambent.core.light.colour import HALF_MAX
from lambent.scenes.scene import IesLight, PointLight
from lambent.store.lamp_discs import SIDE, axes_of, directions, reach_deg

MOST_HITS = 16  # surfaces along a ray that may lie in a shadow


def shadow_map(
    scene: Any, lamp: PointLight | IesLight, size: tuple[int, int]
) -> tuple[NDArray[np.float16], NDArray[np.bool_]]:
    """Distances (SIDE, SIDE) from a lamp to the first surfaces of a mi.Scene that block light; HALF_MAX for none.

    And the texels (H, W) of a light map of this `size` that lie behind these, in the shadow of at least one ray.
    """
    local, there = directions(reach_deg(lamp))
    world = local @ axes_of(lamp)
    ray = rays.rays_from(np.asarray(lamp.position) + rays.APPROACH * world, world)
    shaded = dr.zeros(mi.UInt32, size[0] * size[1])
    distance = _first_hits(scene, mi.Ray3f(ray), mi.Point3f(*lamp.position), shaded, size[1], size[0],
                           rays.has_holes(scene))  # fmt: skip
    dr.eval(distance, shaded)
    found = np.where(there, np.minimum(np.array(distance), HALF_MAX), HALF_MAX)
    return found.reshape(SIDE, SIDE).astype(np.float16), np.array(shaded).reshape(size) > 0


@dr.syntax
def _first_hits(scene, ray, start, shaded, width, height, holes):  # type: ignore[no-untyped-def]
    """Distances from `start` to the first hits of rays; texels of later hits become 1 in `shaded`."""
    distance = dr.full(mi.Float, dr.inf, dr.width(ray.o))
    active = dr.full(mi.Bool, True, dr.width(ray.o))
    hits = dr.zeros(mi.UInt32, dr.width(ray.o))
    while active & (hits < MOST_HITS):
        si = rays.intersect(scene, ray, active, holes)
        active &= si.is_valid()
        distance = dr.select(active & (hits == 0), dr.norm(si.p - start), distance)
        dr.scatter(shaded, mi.UInt32(1), light_map_texel(si, width, height, active), active & (hits > 0))
        ray = rays.leaving(scene, si.p, si.n, ray.d)
        hits += 1
    return distance
