"""Combine several geometry files: unique names, a material set, materials assigned by name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path

from lambent.core.errors import UserError, did_you_mean
from lambent.core.plain import UniqueNames, first_of
from lambent.materials.document import Material
from lambent.scenes.loaders.contents import Contents
from lambent.scenes.scene import MaterialTextures, SceneObject

NAMES_HINT = "see the names with `lambent inspect`"


def assembled(contents: Sequence[Contents], variant: str | None, path: Path) -> Contents:
    """Objects, materials, textures and warnings of all files; `variant` is a material set of those that have it.

    Names of objects that are taken get a number. So do those of materials, unless both are the same.

    Raises
    ------
    UserError
        If no file has the variant.
    """
    known = {name for c in contents for name in c.variants}
    if variant is not None and variant not in known:
        hint = did_you_mean(variant, known) or ("the geometry has no variants" if not known else None)
        raise UserError(
            "unknown variant", file=path, field="variant", got=variant, expected=", ".join(sorted(known)) or None,
            hint=hint,
        )  # fmt: skip
    objects: list[SceneObject] = []
    materials: dict[str, Material] = {}
    textures: dict[str, MaterialTextures] = {}
    warnings: list[str] = []
    names = UniqueNames()
    for c in contents:
        called = _own_names(c, materials, textures, warnings)
        for o in c.objects_in(variant):
            objects.append(replace(o, name=names.unique(o.name), material=called.get(o.material, o.material)))
        materials |= {called[n]: m.model_copy(update={"name": called[n]}) for n, m in c.materials.items()}
        textures |= {called[n]: t for n, t in c.textures.items() if n in called}
        warnings += c.warnings
    return Contents(tuple(objects), materials, textures=textures, warnings=tuple(warnings))


def _own_names(
    contents: Contents, materials: Mapping[str, Material], textures: Mapping[str, MaterialTextures], warnings: list[str]
) -> dict[str, str]:
    """Names for a file's materials that are distinct from those of other files."""
    called: dict[str, str] = {}
    names = UniqueNames({*materials, *contents.materials})
    for name, material in contents.materials.items():
        same = name in materials and material == materials[name] and contents.textures.get(name) is textures.get(name)
        called[name] = name
        if name in materials and not same:
            called[name] = names.unique(name)
            warnings.append(
                f"material {name}: two files have a material of this name; the second is renamed to {called[name]}"
            )
    return called


def assigned(
    rules: Mapping[str, str], objects: Iterable[SceneObject], materials: Mapping[str, Material], path: Path
) -> tuple[tuple[SceneObject, ...], list[str]]:
    """Objects with materials assigned by rules, and warnings about rules that match nothing.

    A rule is a pattern with * and ? over the names of objects and of their original materials; later ones win.

    Raises
    ------
    UserError
        If a rule names an unknown material.
    """
    by_name = {o.name: o for o in objects}
    originals = {name: o.material for name, o in by_name.items()}
    warnings, idle = [], []
    for pattern, material in rules.items():
        check_material(material, materials, path, f"assign.{pattern}")
        fits = [n for n, was in originals.items() if fnmatchcase(n, pattern) or fnmatchcase(was, pattern)]
        for name in fits:
            by_name[name] = replace(by_name[name], material=material)
        if not fits and (hint := did_you_mean(pattern, [*originals.values(), *originals])):
            warnings.append(f"assign.{pattern} matches no object and no material: {hint}")
        elif not fits:
            idle.append(f"assign.{pattern}")
    if idle:
        verb = "matches" if len(idle) == 1 else "match"
        warnings.append(f"{first_of(idle)} {verb} no object and no material: {NAMES_HINT}")
    return tuple(by_name.values()), warnings


def check_material(name: str, materials: Mapping[str, Material], path: Path, field: str) -> None:
    """Raise `UserError` if a scene.toml names an unknown material."""
    if name not in materials:
        hint = did_you_mean(name, materials) or f"define it under [materials.{name}]"
        raise UserError("unknown material", file=path, field=field, got=name, hint=hint)


def fitting(pattern: str, names: Iterable[str], path: Path, field: str, got: str | None = None) -> list[str]:
    """The names that match a pattern with * and ?; `UserError` if none does."""
    names = list(names)
    fits = [name for name in names if fnmatchcase(name, pattern)]
    if not fits:
        hint = did_you_mean(pattern, names) or NAMES_HINT
        raise UserError("matches no object", file=path, field=field, got=got, hint=hint)
    return fits
