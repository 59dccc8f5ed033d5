"""glTF's textures: which picture, which of a mesh's uv, laid out how."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from lambent.core.errors import UserError
from lambent.scenes.loaders.glb import Gltf, is_missing, resource
from lambent.scenes.loaders.gltf_schema import MaterialDocument, TextureReference
from lambent.scenes.loaders.pictures import Picture, Pictures
from lambent.scenes.loaders.varying import UvTransform, Varying

REPEAT = 10497
_TURNED = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, 1.0]])


class Textures:
    """The textures of one file."""

    def __init__(self, gltf: Gltf) -> None:
        self._gltf = gltf
        self.pictures = Pictures()
        self.sources: list[Path] = []

    def of(
        self, reference: TextureReference | None, uv_set: int, said: list[str]
    ) -> tuple[Picture, UvTransform] | None:
        """A reference's picture and layout; None where there is none.

        One laid out on another uv set than `uv_set` cannot lie right: it comes as one texel, its mean.
        """
        if reference is None:
            return None
        gltf = self._gltf
        texture = gltf.pick(gltf.document.textures, reference.index, "textures")
        picture = None if texture.image is None else self._picture(texture.image, said)
        if texture.image is None:
            said.append(f"texture {reference.index} has no picture of a kind that is read: its factor stands alone")
        if picture is None:
            return None
        if uv_set_of(reference) != uv_set:
            said.append("uses two sets of uv: what lies on the second is averaged")
            mean = picture.texels.mean(axis=(0, 1), keepdims=True)
            return Picture(np.rint(mean).astype(picture.texels.dtype), picture.alpha), layout(None)
        if texture.sampler is not None:
            sampler = gltf.pick(gltf.document.samplers, texture.sampler, "samplers")
            if (sampler.wrapS, sampler.wrapT) != (REPEAT, REPEAT):
                said.append("its pictures are repeated beyond their edges, not clamped or mirrored")
        return picture, layout(reference)

    def rgb(self, reference: TextureReference | None, uv_set: int, said: list[str], *, srgb: bool) -> Varying | None:
        """Linear values (H, W, 3) of a reference."""
        found = self.of(reference, uv_set, said)
        return None if found is None else Varying(found[0].rgb(srgb=srgb), found[1])

    def _picture(self, image: int, said: list[str]) -> Picture | None:
        """A picture; None where its file is not there, which `said` is told."""
        gltf, field = self._gltf, f"images.{image}"
        document = gltf.pick(gltf.document.images, image, "images")
        if document.uri is not None and is_missing(document.uri, gltf.path, field, gltf.root):
            said.append(f"picture {document.uri} is not there: its factor stands alone")
            return None
        if document.uri is not None:
            data, source = resource(document.uri, gltf.path, field, gltf.root)
            if source is not None and source not in self.sources:
                self.sources.append(source)
        elif document.bufferView is not None:
            buffer, start, length, _ = gltf.view(document.bufferView)
            data = buffer[start : start + length]
        else:
            raise UserError("picture has neither a uri nor a buffer view", file=gltf.path, field=field)
        return self.pictures.of_bytes(image, data, gltf.path, field)


def uv_set_of(reference: TextureReference) -> int:
    """The TEXCOORD that a reference lies on."""
    moved = reference.extensions.KHR_texture_transform
    return reference.texCoord if moved is None or moved.texCoord is None else moved.texCoord


def main_uv_set(document: MaterialDocument) -> int:
    """The uv set of a material's first texture, which its meshes get."""
    return next((uv_set_of(reference) for reference in references(document)), 0)


def references(document: MaterialDocument) -> Iterable[TextureReference]:
    """The textures of a material that are read, the most visible first."""
    pbr, more = document.pbrMetallicRoughness, document.extensions
    older = more.KHR_materials_pbrSpecularGlossiness
    named = (
        older.diffuseTexture if older is not None else None,
        older.specularGlossinessTexture if older is not None else None,
        pbr.baseColorTexture,
        document.normalTexture,
        pbr.metallicRoughnessTexture,
        more.KHR_materials_anisotropy.anisotropyTexture,
        document.emissiveTexture,
    )
    return [reference for reference in named if reference is not None]


def layout(reference: TextureReference | None) -> UvTransform:
    """Our uv transform of KHR_texture_transform, whose v points down.

    u' = offset + rotation scale u, turning counter-clockwise as seen on the picture.
    """
    moved = reference.extensions.KHR_texture_transform if reference is not None else None
    if moved is None:
        return (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    c, s = math.cos(moved.rotation), math.sin(moved.rotation)
    theirs = np.eye(3)
    theirs[:2, :2] = np.array([[c, s], [-s, c]]) * moved.scale
    theirs[:2, 2] = moved.offset
    m = np.round(_TURNED @ theirs @ _TURNED, 12)
    (a, b, x), (d, e, y) = m[:2].tolist()
    return (a, b, x), (d, e, y)
