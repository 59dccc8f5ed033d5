"""Points that fill the box of an object, for whatever stands there in its place (thesis R, "Object Replacement").

Maps are taken without the object, so that no self-reflection is in them. Points lie evenly in the box and around it,
since a surface is asked for points above its horizon; those that the box does not see are dropped.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.baking.light_fields.placing import Placed
from lambent.baking.tracing.rays import towards
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.baking.tracing.solids import SolidTest
from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.geometry.directions import normalize
from lambent.scenes.scene import Mesh

MARGIN = 1 / 8  # of the box's longest side, that points lie around it
WITHIN = 0.98  # of the box, to which a point outside of it must have a free view: what it touches hides nothing
TRIED = 8  # places for each point at most
GOLDEN = 1.2207440846057596  # root of x^4 = x + 1: the lattice of Roberts (2018) in three dimensions


def volume_points(builder: SceneBuilder, mesh: Mesh, name: str, count: int) -> Placed:
    """`count` points in and around the box of an object, or less where little of that is free.

    Raises
    ------
    UserError
        Where nothing of it is.
    """
    scene = builder.build(leave_out={name})
    low, high = (side.astype(float) for side in mesh.bounds)
    margin = MARGIN * float((high - low).max())
    places = low - margin + even_places(TRIED * count) * (high - low + 2 * margin)
    free = places[_is_free(builder, scene, places, (low, high))][:count]
    if not len(free):
        raise UserError("its box has no free space", hint="leave out its light field")
    return Placed(free, normalize(free - (low + high) / 2 + 1e-9), offset_m=margin)


def even_places(count: int) -> Floats:
    """(count, 3) places of the unit cube, any first of which are evenly spread."""
    steps = (np.arange(count)[:, None] + 1) * GOLDEN ** -np.arange(1.0, 4.0)
    return np.asarray((0.5 + steps) % 1)


def spacing_m(mesh: Mesh, count: int) -> float:
    """How far points of a volume are from each other."""
    low, high = (side.astype(float) for side in mesh.bounds)
    return float(((high - low + 2 * MARGIN * (high - low).max()).prod() / count) ** (1 / 3))


def _is_free(builder: SceneBuilder, scene: Any, places: Floats, bounds: tuple[Floats, Floats]) -> Any:
    middle, half = (bounds[0] + bounds[1]) / 2, WITHIN * (bounds[1] - bounds[0]) / 2
    nearest = middle + np.clip(places - middle, -half, half)
    outside = np.linalg.norm(places - nearest, axis=1) > 1e-9
    nearest[~outside] = middle  # a place in the box asks for nothing, but rays need a direction
    view = normalize(nearest - places + np.where(outside, 0, 1e-9)[:, None])
    hidden = np.array(scene.ray_test(towards(scene, places, view, nearest))) & outside
    solids = SolidTest(builder, scene)
    within = solids.embedded(places, view) | solids.embedded(places, -view)
    return ~hidden & ~within
