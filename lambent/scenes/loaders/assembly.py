"""Several geometry files as one: names kept apart, material sets chosen, materials assigned by name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path

from lambent.core.errors import UserError, did_you_mean
from lambent.materials.document import Material
from lambent.scenes.loaders.parts import Parts, unique_name
from lambent.scenes.scene import MaterialTextures, SceneObject


@dataclass(frozen=True)
class Assembly:
    """Objects of all files, and what they wear, by name."""

    objects: tuple[SceneObject, ...]
    materials: dict[str, Material]
    textures: dict[str, MaterialTextures]
    warnings: tuple[str, ...]


def assembled(parts: Sequence[Parts], variant: str | None, path: Path) -> Assembly:
    """All parts as one; of files with material sets the one called `variant`.

    Names of objects that are taken get a number. So do those of materials, unless both are the same.

    Raises
    ------
    UserError
        Where no file has the variant.
    """
    known = {name for p in parts for name in p.variants}
    if variant is not None and variant not in known:
        hint = did_you_mean(variant, known) or ("the geometry has none" if not known else None)
        raise UserError(
            "unknown variant", file=path, field="variant", got=variant, expected=", ".join(sorted(known)) or None,
            hint=hint,
        )  # fmt: skip
    objects: list[SceneObject] = []
    materials: dict[str, Material] = {}
    textures: dict[str, MaterialTextures] = {}
    warnings: list[str] = []
    taken: set[str] = set()
    for p in parts:
        called = _own_names(p, materials, textures, warnings)
        looks = p.variants.get(variant, {}) if variant is not None else {}
        for o in p.objects:
            material, emission = looks.get(o.name, (o.material, o.emission))
            name, material = unique_name(o.name, taken), called.get(material, material)
            objects.append(replace(o, name=name, material=material, emission=emission))
        materials |= {called[n]: m.model_copy(update={"name": called[n]}) for n, m in p.materials.items()}
        textures |= {called[n]: t for n, t in p.textures.items() if n in called}
        warnings += p.warnings
    return Assembly(tuple(objects), materials, textures, tuple(warnings))


def _own_names(
    part: Parts, materials: Mapping[str, Material], textures: Mapping[str, MaterialTextures], warnings: list[str]
) -> dict[str, str]:
    """What a file's materials are called where other files have theirs already."""
    called: dict[str, str] = {}
    taken = set(materials) | set(part.materials)
    for name, material in part.materials.items():
        same = name in materials and material == materials[name] and part.textures.get(name) is textures.get(name)
        called[name] = name
        if name in materials and not same:
            called[name] = unique_name(name, taken)
            warnings.append(f"material {name}: two files have one of this name, the second is now {called[name]}")
    return called


def assigned(
    rules: Mapping[str, str], objects: Iterable[SceneObject], materials: Mapping[str, Material], path: Path
) -> tuple[tuple[SceneObject, ...], list[str]]:
    """Objects that wear what the rules say, and a warning for each rule that fits nothing.

    A rule is a pattern with * and ? over the names of objects and of the materials they came with; later ones win.

    Raises
    ------
    UserError
        Where a rule names a material that is not there.
    """
    by_name = {o.name: o for o in objects}
    originals = {name: o.material for name, o in by_name.items()}
    warnings = []
    for pattern, material in rules.items():
        if material not in materials:
            hint = did_you_mean(material, materials) or f"describe it under [materials.{material}]"
            raise UserError("unknown material", file=path, field=f"assign.{pattern}", got=material, hint=hint)
        fits = [n for n, was in originals.items() if fnmatchcase(n, pattern) or fnmatchcase(was, pattern)]
        for name in fits:
            by_name[name] = replace(by_name[name], material=material)
        if not fits:
            hint = did_you_mean(pattern, [*originals.values(), *originals]) or "see the names with `lambent inspect`"
            warnings.append(f"assign.{pattern} fits no object and no material: {hint}")
    return tuple(by_name.values()), warnings
