"""The variants of a scene.toml: those of its geometry files, and its [[variants]], which may extend them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from lambent.core.errors import UserError
from lambent.core.light.light_mix import LightMix
from lambent.scenes.loaders.scene_toml.assembly import check_material, fitting
from lambent.scenes.loaders.scene_toml.looks import parse_looks, parse_mixes
from lambent.scenes.loaders.scene_toml.material_files import LookFiles
from lambent.scenes.loaders.scene_toml.schema import VariantSection
from lambent.scenes.looks.variants import VariantByObject, looks_as_loaded
from lambent.scenes.scene import Scene


def parse_variants(
    sections: Sequence[VariantSection],
    of_geometry: Mapping[str, Sequence[str]],
    scene: Scene,
    files: LookFiles,
) -> list[VariantByObject]:
    """The variants of a scene.toml.

    Parameters
    ----------
    of_geometry : mapping
        Variants of the geometry files: the material of each of the scene's objects.
    files : LookFiles
        The scene.toml, and the files that it refers to.

    Raises
    ------
    UserError
        If a section uses unknown names or invalid values.
    """
    path = files.path
    for name, times in Counter(section.name for section in sections).items():
        if times > 1:
            raise UserError("name is used twice", file=path, field="variants", got=name)
    described = {section.name: section for section in sections}
    as_loaded, loaded = [o.material for o in scene.objects], looks_as_loaded(scene.materials, scene.textures)
    has_colour = {name: one.diffuse is not None for name, one in scene.textures.items()}
    found = []
    for name in dict.fromkeys([*of_geometry, *described]):
        materials = list(of_geometry.get(name, as_loaded))
        section = described.get(name) or VariantSection(name=name)
        materials = _exchanged(section, materials, scene, path)
        changes = parse_looks(section.materials, loaded, has_colour, files, f"variants.{section.name}.materials")
        looks = {**loaded, **changes}
        found.append(VariantByObject(name, [looks[material] for material in materials], _mix(section, path)))
    return found


def _exchanged(section: VariantSection, materials: list[str], scene: Scene, path: Path) -> list[str]:
    """The materials of objects after the section's exchanges; later patterns win."""
    names = [o.name for o in scene.objects]
    for pattern, material in section.objects.items():
        field = f"variants.{section.name}.objects.{pattern}"
        check_material(material, scene.materials, path, field)
        fitting(pattern, names, path, field)
        materials = [
            material if fnmatchcase(name, pattern) else was for name, was in zip(names, materials, strict=True)
        ]
    return materials


def _mix(section: VariantSection, path: Path) -> LightMix:
    mix = LightMix()
    for name, one in parse_mixes(section.light, path, f"variants.{section.name}.light").items():
        mix = mix.changed(name, one)
    return mix
