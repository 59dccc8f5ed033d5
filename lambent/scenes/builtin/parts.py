"""How the built-in scenes name and place their things."""

from __future__ import annotations

from collections.abc import Sequence

from lambent.scenes.geometry import box, merge, placed
from lambent.scenes.scene import Mesh, SceneObject, Triple

POLISHED_SCALE = 0.2  # light map density of bare metal: it has no diffuse term to show


def thing(name: str, material: str, *meshes: Mesh, light_map_scale: float = 1.0) -> SceneObject:
    """A named object of one material, made of any number of meshes."""
    return SceneObject(name, merge(meshes), material, light_map_scale=light_map_scale)


def block(low: Triple, high: Triple, bevel: float = 0.0, brushed: Triple = (1, 0, 0), segments: int = 1) -> Mesh:
    """Box between two corners, in metres."""
    size = tuple(h - lo for lo, h in zip(low, high, strict=True))
    middle = tuple((h + lo) / 2 for lo, h in zip(low, high, strict=True))
    return placed(box(size, bevel, brushed, segments), middle)


def at(objects: Sequence[SceneObject], position: Triple, yaw: object = None) -> list[SceneObject]:
    """`objects` turned by the rotation `yaw` about the origin, then moved to `position`."""
    return [
        SceneObject(o.name, placed(o.mesh, position, yaw), o.material, o.emission, o.light_map_scale) for o in objects
    ]
