"""Textures in a store: one array per image and material; uv transforms are in the scene record."""

from __future__ import annotations

from collections.abc import Mapping

from lambent.scenes.looks.textures import CHANNELS, check, digest, parts
from lambent.scenes.scene import MaterialTextures, Texture
from lambent.store.contract import SceneRecord, TexturesRecord, texture_name
from lambent.store.store import Store


def texture_records(textures: Mapping[str, MaterialTextures]) -> dict[str, TexturesRecord]:
    """The scene record's entries for textures, by material."""
    return {
        material: TexturesRecord(parts={n: t.uv_transform for n, t in parts(of).items()}, cutoff=of.cutoff)
        for material, of in textures.items()
    }


def write_textures(store: Store, textures: Mapping[str, MaterialTextures]) -> None:
    """Write the images that the store lacks."""
    for material, of_material in textures.items():
        for part, texture in parts(of_material).items():
            name, key = texture_name(material, part), digest(texture)
            if name not in store or store.artefact(name).key != key:
                store.put(name, "texture", texture.texels, key=key)


def read_textures(store: Store, record: SceneRecord) -> dict[str, MaterialTextures]:
    """The textures of a scene record, by material; an image shared by several materials is one array in memory."""
    read: dict[str, Texture] = {}
    found = {}
    for material, said in record.textures.items():
        textures = {}
        for part in (part for part in CHANNELS if part in said.parts):
            name = texture_name(material, part)
            key = store.artefact(name).key
            if key not in read:
                read[key] = Texture(store.read(name), said.parts[part])
            textures[part] = read[key]
            check(material, part, read[key])
        found[material] = MaterialTextures(**textures, cutoff=said.cutoff)
    return found
