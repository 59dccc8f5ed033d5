"""The contents of a geometry file, and a scene of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from lambent.core.camera import Camera, overview
from lambent.core.plain import Triple
from lambent.materials.document import Material
from lambent.scenes.scene import Environment, Light, MaterialTextures, Scene, SceneObject, SunSky, bounds_of

DAYLIGHT = SunSky(sun_direction=(0.4558, 0.7597, 0.4637))


@dataclass(frozen=True)
class Contents:
    """Objects in world space, and everything else in the file that Lambent reads.

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

    def scene(self, name: str) -> Scene:
        """A scene of this file alone, with daylight and a camera if it lacks them."""
        shines = bool(self.environment or self.lights or any(any(o.emission) for o in self.objects))
        own_light = self.environment is not None or (self.tells_its_light and shines)
        notes = ("nothing in it emits light: it gets daylight",) if self.tells_its_light and not own_light else ()
        return Scene(
            name=name,
            objects=self.objects,
            materials=self.materials,
            environment=self.environment if own_light else DAYLIGHT,
            lights=self.lights,
            cameras=self.cameras or (overview(*bounds_of(self.objects)),),
            sources=self.sources,
            warnings=(*self.warnings, *notes),
            textures=self.textures,
        )


class UniqueNames:
    """Gives every name once; those in `taken` are given already."""

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._taken = set(taken)
        self._tried: Counter[str] = Counter()

    def unique(self, name: str) -> str:
        """`name`, or the first of name_2, name_3... that is free.

        The search goes on where it ended, so that the thousandth object of a name costs what the second does.
        """
        candidate = name
        while candidate in self._taken:
            self._tried[name] += 1
            candidate = f"{name}_{self._tried[name] + 1}"
        self._taken.add(candidate)
        return candidate
