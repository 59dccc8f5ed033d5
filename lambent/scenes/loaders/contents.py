"""The contents of a geometry file, and a scene made of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from lambent.core.plain import Triple
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.scenes.first_view import first_views
from lambent.scenes.looks.variants import VariantByObject, looks_as_loaded, with_variants
from lambent.scenes.scene import (
    DirectionalLight,
    Environment,
    Light,
    MaterialTextures,
    Mesh,
    Scene,
    SceneObject,
    SunSky,
)

DAYLIGHT = SunSky(sun_direction=(0.4558, 0.7597, 0.4637))


@dataclass(frozen=True)
class LoadOptions:
    """Options of every loader.

    Files that the file refers to must be below `root`, by default its own folder. Normals that the file lacks are flat,
    or, with `crease_deg`, smooth where faces meet at less than this angle.
    """

    root: Path | None = None
    crease_deg: float | None = None


DEFAULTS = LoadOptions()


@dataclass(frozen=True)
class Contents:
    """Objects in world space, and everything else that Lambent reads from the file.

    `variants` are its material sets: variant -> object -> its material there and the radiance it then emits;
    `materials` has those of all variants. A scene of this file alone gets daylight unless `tells_its_light`, or if
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
    credit: str = ""

    def scene(self, name: str) -> Scene:
        """A scene of this file alone, with daylight and a camera if it lacks them."""
        shines = bool(self.environment or self.lights or any(any(o.emission) for o in self.objects))
        own_light = self.environment is not None or (self.tells_its_light and shines)
        notes = ("it has no light: daylight is added",) if self.tells_its_light and not own_light else ()
        sets = {variant: self.objects_in(variant) for variant in self.variants}
        scene = Scene(
            name=name,
            objects=self.objects,
            materials=self.materials,
            environment=self.environment if own_light else daylight_with(self.lights),
            lights=self.lights,
            cameras=self.cameras or first_views(self.objects),
            sources=self.sources,
            warnings=(*self.warnings, *notes, *emission_warnings(self.objects, sets)),
            textures=self.textures,
            credit=self.credit,
        )
        looks = looks_as_loaded(scene.materials, scene.textures)
        return with_variants(scene, [
            VariantByObject(variant, [looks[o.material] for o in objects]) for variant, objects in sets.items()
        ])  # fmt: skip

    def objects_in(self, variant: str | None) -> tuple[SceneObject, ...]:
        """The objects in the material set `variant`; unchanged if the file has none of this name."""
        changed = {} if variant is None else self.variants.get(variant, {})
        found = ((o, *changed.get(o.name, (o.material, o.emission))) for o in self.objects)
        return tuple(replace(o, material=material, emission=emission) for o, material, emission in found)


def grey_thing(path: Path, mesh: Mesh, notes: Sequence[str]) -> Contents:
    """The mesh of a file without materials, in grey."""
    grey = Material(name="default", kd=(0.5, 0.5, 0.5))
    thing = SceneObject(path.stem, mesh, grey.name)
    return Contents((thing,), {grey.name: grey}, sources=(path,), warnings=tuple(notes))


def daylight_with(lights: Sequence[Light]) -> SunSky:
    """Daylight, without its sun if a directional light comes from above: the brightest such light is the sun."""
    suns = [light for light in lights if isinstance(light, DirectionalLight) and light.direction[1] < 0]
    if not suns:
        return DAYLIGHT
    x, y, z = max(suns, key=lambda light: sum(light.irradiance)).direction
    return replace(DAYLIGHT, sun_direction=(-x, -y, -z), sun_scale=0.0)


def emission_warnings(objects: Sequence[SceneObject], variants: Mapping[str, Sequence[SceneObject]]) -> Iterator[str]:
    """A warning for each variant, the same objects in other materials, that would emit different light."""
    for variant, changed in variants.items():
        others = [o.name for o, now in zip(objects, changed, strict=True) if now.emission != o.emission]
        if others:
            yield f"variant {variant}: {', '.join(others[:2])} would change emission, which is ignored"
