"""What a geometry file gives to a scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from lambent.core.camera import Camera
from lambent.core.plain import Triple
from lambent.materials.document import Material
from lambent.scenes.scene import Environment, Light, MaterialTextures, SceneObject


@dataclass(frozen=True)
class Contents:
    """Objects in world space, and what else the file holds.

    `variants` are its material sets: variant -> object -> its material there and the radiance it then emits;
    `materials` holds those of all variants. A scene of this file alone gets daylight unless `tells_its_light`, or if
    nothing in it emits light.
    """

    objects: tuple[SceneObject, ...]
    materials: Mapping[str, Material] = field(default_factory=dict)
    lights: tuple[Light, ...] = ()
    cameras: tuple[Camera, ...] = ()
    sources: tuple[Path, ...] = ()
    warnings: tuple[str, ...] = ()
    textures: Mapping[str, MaterialTextures] = field(default_factory=dict)  # by the material's name
    environment: Environment | None = None
    tells_its_light: bool = False
    variants: Mapping[str, Mapping[str, tuple[str, Triple]]] = field(default_factory=dict)


def unique_name(name: str, taken: set[str]) -> str:
    """`name`, or name_2, name_3... where that is taken; the answer is added to `taken`."""
    candidate, count = name, 1
    while candidate in taken:
        count += 1
        candidate = f"{name}_{count}"
    taken.add(candidate)
    return candidate
