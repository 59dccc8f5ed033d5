"""Changed materials of a picture: looks of variants and keyframes, exchanged textures, colours."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from lambent.core.errors import UserError
from lambent.core.plain import Triple
from lambent.materials.document import Material
from lambent.materials.recolour import recoloured
from lambent.scenes.looks.retexturing import NO_UV, NO_UV_HINT, retextured
from lambent.scenes.looks.variants import looks_as_loaded
from lambent.scenes.scene import ImageTexture, Look, MaterialTextures


@dataclass(frozen=True)
class Edits:
    """`looks` that differ from the scene's, and the documents of all changed `materials`, by name."""

    looks: Mapping[str, Look] = field(default_factory=dict)
    materials: Mapping[str, Material] = field(default_factory=dict)


def edits_of(
    materials: Mapping[str, Material],
    textured: Mapping[str, MaterialTextures],
    without_uv: Collection[str],
    looks: Mapping[str, Look],
    colours: Mapping[str, Triple],
    textures: Mapping[str, str],
) -> Edits:
    """Apply looks, then textures (`scenes.looks.retexturing`), then diffuse colours to a scene's `materials`.

    `textured` are the scene's textures by material; materials `without_uv` cannot show images.
    """
    loaded = looks_as_loaded(materials, textured)
    if textures:
        looks = {**looks, **retextured({**loaded, **looks}, textures, textured, without_uv)}
    changed = {name: look for name, look in looks.items() if look != loaded[name]}
    for name, look in changed.items():
        if isinstance(look.textures, ImageTexture) and name in without_uv:
            raise UserError(NO_UV, field=name, hint=NO_UV_HINT)
    documents = {name: look.material for name, look in changed.items()}
    return Edits(changed, {**documents, **recoloured({**materials, **documents}, colours)})
