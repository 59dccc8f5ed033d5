"""Variants of a scene: other looks of its materials, and other mixes of its light, selectable without a bake.

A file gives the look of each object in a variant; the scene stores it by material, because light between surfaces is
computed by material. So objects that share a material, but differ in some variant, get separate materials.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.light.light_mix import LightMix
from lambent.core.plain import UniqueNames
from lambent.materials.document import Material
from lambent.scenes.looks.image_textures import with_image
from lambent.scenes.scene import ImageTexture, Look, MaterialTextures, Scene, Variant

FIELD = "--variant"
NO_VARIANTS = "the store has no variants"
NO_VARIANTS_HINT = "add [[variants]] to the scene and bake it again, or store states in the window"
Kept = TypeVar("Kept")


@dataclass(frozen=True)
class VariantByObject:
    """A variant of a file: the look of each object, in the scene's order, and the mix of the light.

    Objects of equal looks share one `Look`.
    """

    name: str
    looks: Sequence[Look]
    light: LightMix = field(default_factory=LightMix)


def with_variants(scene: Scene, told: Sequence[VariantByObject]) -> Scene:
    """The scene with variants; objects that need a separate material get a copy of theirs under a new name."""
    names, materials, objects = UniqueNames(scene.materials), dict[tuple[object, ...], str](), []
    for number, o in enumerate(scene.objects):
        future = (o.material, *(id(one.looks[number]) for one in told))
        if future not in materials:
            materials[future] = names.unique(o.material) if o.material in materials.values() else o.material
        objects.append(replace(o, material=materials[future]))
    copies = {own: str(future[0]) for future, own in materials.items() if own != future[0]}
    renamed = {own: scene.materials[of].model_copy(update={"name": own}) for own, of in copies.items()}
    whole = replace(
        scene, objects=tuple(objects), materials={**scene.materials, **renamed},
        textures=_copied(scene.textures, copies), measured=_copied(scene.measured, copies),
        warnings=(*scene.warnings, *(f"material {of}: variants split its objects; the others get {own}" for own, of in
                                     copies.items())),
    )  # fmt: skip
    return replace(whole, variants=tuple(Variant(one.name, _changed(whole, one), one.light) for one in told))


def _copied(of_materials: Mapping[str, Kept], copies: Mapping[str, str]) -> dict[str, Kept]:
    """A mapping by material, extended to the copies of materials."""
    return {**of_materials, **{own: of_materials[of] for own, of in copies.items() if of in of_materials}}


def _changed(scene: Scene, one: VariantByObject) -> dict[str, Look]:
    """The looks of a variant by material, where they differ from the scene's."""
    found, own = {}, scene.textures
    loaded = looks_as_loaded(scene.materials, own)
    for o, look in zip(scene.objects, one.looks, strict=True):
        name, now = o.material, loaded[o.material]
        same_document = now.material.model_copy(update={"name": look.material.name}) == look.material
        if not same_document or textures_in_look(name, now, own) is not textures_in_look(name, look, own):
            found[name] = look
    return found


def looks_as_loaded(materials: Mapping[str, Material], textured: Collection[str]) -> dict[str, Look]:
    """Looks of materials as loaded; `textured` are the names of those with textures."""
    return {name: Look(material, name if name in textured else "") for name, material in materials.items()}


def documents_of(scene: Scene, material: str) -> list[Material]:
    """A material of the scene as loaded, and as in each variant."""
    shown = (variant.looks.get(material) for variant in scene.variants)
    return [scene.materials[material], *(look.material for look in shown if look is not None)]


def variant_named(variants: Iterable[Variant], name: str, field: str = FIELD) -> Variant:
    """The variant of this name; `UserError` that lists all of them if there is none."""
    found = {variant.name: variant for variant in variants}
    if not found:
        raise UserError(NO_VARIANTS, field=field, got=name, hint=NO_VARIANTS_HINT)
    return found[known("variant", name, found, field=field)]


def textures_in_look(name: str, look: Look, textures: Mapping[str, MaterialTextures]) -> MaterialTextures | None:
    """The textures of a material in a look; `UserError` for an image that cannot be read."""
    of = look.textures
    return with_image(textures.get(name), of) if isinstance(of, ImageTexture) else textures.get(of)


def textures_in_looks(
    textures: Mapping[str, MaterialTextures], looks: Mapping[str, Look]
) -> dict[str, MaterialTextures]:
    """The textures of each material after some get other looks."""
    changed = {name: textures_in_look(name, look, textures) for name, look in looks.items()}
    return {name: found for name, found in {**textures, **changed}.items() if found is not None}
