"""What a geometry file gives to a scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from lambent.materials.document import Material
from lambent.scenes.scene import Camera, Light, MaterialTextures, SceneObject


@dataclass(frozen=True)
class Parts:
    """Objects in world space, and whatever else the file holds."""

    objects: tuple[SceneObject, ...]
    materials: Mapping[str, Material] = field(default_factory=dict)
    lights: tuple[Light, ...] = ()
    cameras: tuple[Camera, ...] = ()
    sources: tuple[Path, ...] = ()
    warnings: tuple[str, ...] = ()
    textures: Mapping[str, MaterialTextures] = field(default_factory=dict)  # by the material's name


def unique_name(name: str, taken: set[str]) -> str:
    """`name`, or name_2, name_3... where that is taken; the answer is added to `taken`."""
    candidate, count = name, 1
    while candidate in taken:
        count += 1
        candidate = f"{name}_{count}"
    taken.add(candidate)
    return candidate
