"""glTF's textures: images, uv sets and transforms."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from lambent.core.errors import UserError
from lambent.scenes.loaders.gltf.container import Gltf, is_remote
from lambent.scenes.loaders.gltf.schema import MaterialDocument, TextureReference
from lambent.scenes.loaders.surfaces.texture_images import TextureImage, TextureImages
from lambent.scenes.loaders.surfaces.textured import Textured, flipped_uv
from lambent.scenes.scene import IDENTITY, UvTransform

REPEAT = 10497


class Textures:
    """The textures of one file."""

    def __init__(self, gltf: Gltf) -> None:
        self._gltf = gltf
        self.images = TextureImages(gltf.files)

    def of(self, reference: TextureReference | None, uv_set: int, notes: list[str]) -> TextureImage | None:
        """A reference's image with its transform; None if there is none.

        An image on another uv set than `uv_set` is reduced to one texel, its mean.
        """
        if reference is None:
            return None
        gltf = self._gltf
        texture = gltf.pick(gltf.document.textures, reference.index, "textures")
        image = None if texture.image is None else self._image(texture.image, notes)
        if texture.image is None:
            notes.append(f"texture {reference.index} has no readable image: only its factor is used")
        if image is None:
            return None
        if uv_set_of(reference) != uv_set:
            notes.append("uses two sets of uv: textures on the second are averaged")
            mean = image.texels.mean(axis=(0, 1), keepdims=True)
            return TextureImage(np.rint(mean).astype(np.uint8), image.alpha)
        if texture.sampler is not None:
            sampler = gltf.pick(gltf.document.samplers, texture.sampler, "samplers")
            if (sampler.wrapS, sampler.wrapT) != (REPEAT, REPEAT):
                notes.append("its textures are repeated, not clamped or mirrored")
        return replace(image, uv_transform=_uv_transform(reference))

    def rgb(self, reference: TextureReference | None, uv_set: int, notes: list[str], *, srgb: bool) -> Textured | None:
        """Linear values of a reference, 3 channels."""
        image = self.of(reference, uv_set, notes)
        return None if image is None else image.rgb(srgb=srgb)

    def _image(self, number: int, notes: list[str]) -> TextureImage | None:
        """An image; None, with a note, if its file is missing."""
        gltf, field = self._gltf, f"images.{number}"
        document = gltf.pick(gltf.document.images, number, "images")
        if document.uri is not None and is_remote(document.uri):
            notes.append(
                f"picture {document.uri} is on the network: only its factor is used; put the file beside the scene"
            )
            return None
        if document.uri is not None and gltf.is_missing(document.uri, field):
            notes.append(f"picture {document.uri} is missing: only its factor is used")
            return None
        if document.uri is not None:
            data = gltf.resource(document.uri, field)
        elif document.bufferView is not None:
            buffer, start, length, _ = gltf.view(document.bufferView)
            data = buffer[start : start + length]
        else:
            raise UserError("picture has neither a uri nor a buffer view", file=gltf.path, field=field)
        return self.images.within(number, data, gltf.path, field)


def uv_set_of(reference: TextureReference) -> int:
    """The TEXCOORD number of a reference."""
    moved = reference.transform
    return reference.texCoord if moved is None or moved.texCoord is None else moved.texCoord


def main_uv_set(document: MaterialDocument) -> int:
    """The uv set of a material's first texture, used for its meshes."""
    return next((uv_set_of(reference) for reference in references(document)), 0)


def references(document: MaterialDocument) -> Iterable[TextureReference]:
    """The textures of a material that are read, most visible first."""
    pbr, older = document.pbrMetallicRoughness, document.specular_glossiness
    named = (
        older.diffuseTexture if older is not None else None,
        older.specularGlossinessTexture if older is not None else None,
        pbr.baseColorTexture,
        document.normalTexture,
        pbr.metallicRoughnessTexture,
        document.anisotropy.anisotropyTexture,
        document.emissiveTexture,
    )
    return [reference for reference in named if reference is not None]


def _uv_transform(reference: TextureReference) -> UvTransform:
    """Our uv transform of KHR_texture_transform, whose v points down.

    u' = offset + rotation scale u, counter-clockwise as seen on the image.
    """
    moved = reference.transform
    if moved is None:
        return IDENTITY
    c, s = math.cos(moved.rotation), math.sin(moved.rotation)
    theirs = np.eye(3)
    theirs[:2, :2] = np.array([[c, s], [-s, c]]) * moved.scale
    theirs[:2, 2] = moved.offset
    return flipped_uv(theirs, decimals=12)  # removes the rounding residue of right angles
