"""Scenes, and their bake."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lambent.api.describing import variants_in_words
from lambent.api.materials import Material
from lambent.core.views.camera import Camera
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import Scene as Contents


class Scene:
    """A scene: objects with materials, lights, cameras."""

    def __init__(self, contents: Contents) -> None:
        self.contents = contents

    @classmethod
    def read(cls, file: str | Path, crease_deg: float | None = None) -> Scene:
        """Read a scene of a file, or a built-in one; see `lambent.read`."""
        return cls(load_scene(str(file), crease_deg))

    @property
    def name(self) -> str:
        return self.contents.name

    @property
    def materials(self) -> dict[str, Material]:
        """By name."""
        return {name: Material(document) for name, document in self.contents.materials.items()}

    @property
    def cameras(self) -> dict[str, Camera]:
        """By name."""
        return {camera.name: camera for camera in self.contents.cameras}

    def facts(self) -> dict[str, Any]:
        """Contents and repairs, by name."""
        from lambent.scenes.light_groups import groups_before_bake
        from lambent.scenes.scene import SunSky
        from lambent.scenes.sky.clear_sky import daylight_in_words

        scene = self.contents
        low, high = scene.bounds
        return {
            "is": "scene",
            "name": scene.name,
            "objects": len(scene.objects),
            "triangles": self.triangles,
            "object_names": [o.name for o in scene.objects],
            "materials": sorted(scene.materials),
            "environment": type(scene.environment).__name__ if scene.environment else "none",
            **({"daylight": daylight_in_words(scene.environment)} if isinstance(scene.environment, SunSky) else {}),
            "lights": len(scene.lights) + sum(any(o.emission) and o.luminaire is None for o in scene.objects),
            "light_groups": {group.name: ", ".join(group.members) for group in groups_before_bake(scene)},
            "variants": variants_in_words(scene.variants),
            "cameras": [camera.name for camera in scene.cameras],
            "paths": [path.name for path in scene.paths],
            "size_m": (high - low).round(3),
            "warnings": scene.warnings,
        }

    @property
    def triangles(self) -> int:
        return sum(len(o.mesh.faces) for o in self.contents.objects)

    def __repr__(self) -> str:
        scene = self.contents
        size = " x ".join(f"{x:.3g}" for x in scene.bounds[1] - scene.bounds[0])
        return (
            f"Scene({scene.name!r}, {len(scene.objects)} objects, {self.triangles} triangles, "
            f"{len(scene.materials)} materials, {size} m)"
        )
