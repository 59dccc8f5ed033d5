"""Visibility of lights from the pixels of a view, traced ray by ray."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.tracing.rays import has_holes, hidden, in_shadow, leaving, vectors
from lambent.baking.transport.polygon_light import highest_part
from lambent.baking.transport.view_points import ViewPoints
from lambent.scenes.sky.triangle_lights import TriangleLights

BITS = 32


def visibility(
    scene: Any, points: ViewPoints, lights: TriangleLights, behind: NDArray[np.bool_] | None = None
) -> NDArray[np.uint32]:
    """Words (ceil(M / 32), P): bit m % 32 of word m // 32 is set if light m's centre is visible.

    For a glowing surface with its centre below the point's horizon, a place above the horizon is tested instead.

    Parameters
    ----------
    behind : (P,) bool, optional
        Points at which lights behind the shading normal count too; at others these are not traced and count as hidden.
        All points by default.
    """
    words = -(-len(lights) // BITS)
    thread = dr.arange(mi.UInt32, len(points) * words)
    count = dr.opaque(mi.UInt32, len(points))
    at = thread % count
    p, flat, normal = (
        dr.gather(kind, vectors(kind, of), at)
        for kind, of in ((mi.Point3f, points.p), (mi.Vector3f, points.flat), (mi.Vector3f, points.n))
    )
    both = dr.gather(mi.Bool, mi.Bool(np.ones(len(points), bool) if behind is None else behind), at)
    seen = _seen(
        scene, p, flat, normal, both, thread // count * BITS, dr.opaque(mi.UInt32, len(lights)),
        vectors(mi.Vector3f, lights.centres), [vectors(mi.Vector3f, lights.corners[:, c]) for c in range(3)],
        mi.Bool(lights.near), bool(lights.near.any()), has_holes(scene),
    )  # fmt: skip
    return np.array(seen).reshape(words, len(points))


@dr.syntax
def _seen(  # type: ignore[no-untyped-def]
    scene, p, flat, normal, both, first, lights, centres, corners, near, any_near, holes
):
    word, i = mi.UInt32(0), mi.UInt32(0)
    while i < BITS:
        m = first + i
        here = m < lights
        centre = dr.gather(mi.Vector3f, centres, m, here)
        is_near = dr.gather(mi.Bool, near, m, here) if dr.hint(any_near, mode="scalar") else mi.Bool(False)
        if dr.hint(any_near, mode="scalar"):
            at = mi.Vector3f(p)
            places = [dr.gather(mi.Vector3f, corner, m, here) - at for corner in corners]
            highest = highest_part(centre - at, places, normal, dr) + at
            centre = dr.select(is_near & ~both, highest, centre)
        here &= both | (dr.dot(normal, centre - dr.select(is_near, mi.Vector3f(p), 0)) > 0)
        blocked = in_shadow(scene, leaving(scene, p, flat, centre), here & ~is_near, holes, coherent=True)
        if dr.hint(any_near, mode="scalar"):
            blocked |= hidden(scene, p, flat, mi.Point3f(centre), here & is_near, holes) & is_near
        word |= dr.select(here & ~blocked, mi.UInt32(1) << i, 0)
        i += 1
    return word
