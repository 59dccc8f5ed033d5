"""Naming and placing the objects of the built-in scenes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lambent.core.geometry.directions import Floats
from lambent.core.plain import Triple
from lambent.scenes.geometry import box, merge, placed
from lambent.scenes.scene import Mesh, SceneObject

POLISHED_SCALE = 0.2  # light map density of bare metal, which has no diffuse term


def thing(name: str, material: str, *meshes: Mesh, light_map_scale: float = 1.0) -> SceneObject:
    """A named object of one material, made of any number of meshes."""
    return SceneObject(name, merge(meshes), material, light_map_scale=light_map_scale)


def block(low: Triple, high: Triple, bevel: float = 0.0, brushed: Triple = (1, 0, 0), segments: int = 1) -> Mesh:
    """Box between two corners, in metres."""
    return placed(box(np.subtract(high, low), bevel, brushed, segments), np.add(high, low) / 2)


def at(objects: Sequence[SceneObject], position: Triple, rotation: Floats | None = None) -> list[SceneObject]:
    """`objects` rotated about the origin by a 3x3 matrix, then moved to `position`."""
    return [replace(o, mesh=placed(o.mesh, position, rotation)) for o in objects]
