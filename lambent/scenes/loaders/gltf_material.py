"""glTF's metallic-roughness materials as lobes."""

from __future__ import annotations

import io
import math

import numpy as np
from PIL import Image, UnidentifiedImageError

from lambent.core.errors import UserError
from lambent.core.frames import Floats
from lambent.materials.document import Lobe, Material
from lambent.scenes.loaders.glb import Gltf, resource
from lambent.scenes.loaders.gltf_schema import MaterialDocument, TextureReference
from lambent.scenes.scene import Triple

PIXELS_MAX = 1 << 28
ROUGHNESS_MIN = 0.003  # slope; below it single precision loses the lobe


class Textures:
    """Mean texels, each picture read once. Textures are averaged for now; `averaged` says where."""

    def __init__(self, gltf: Gltf) -> None:
        self._gltf = gltf
        self._means: dict[tuple[int, bool], Floats] = {}
        self.averaged: set[str] = set()

    def mean(self, reference: TextureReference | None, srgb: bool, used_by: str) -> Floats:
        """Mean (3,) of a texture, linear; ones where there is none."""
        if reference is None:
            return np.ones(3)
        gltf = self._gltf
        texture = gltf.pick(gltf.document.textures, reference.index, "textures")
        if texture.source is None:
            raise UserError("texture has no picture", file=gltf.path, field=f"textures.{reference.index}")
        self.averaged.add(used_by)
        key = (texture.source, srgb)
        if key not in self._means:
            self._means[key] = self._read(texture.source, srgb)
        return self._means[key]

    def _read(self, source: int, srgb: bool) -> Floats:
        gltf, field = self._gltf, f"images.{source}"
        image = gltf.pick(gltf.document.images, source, "images")
        if image.uri is not None:
            data, _ = resource(image.uri, gltf.path, field)
        elif image.bufferView is not None:
            buffer, start, length, _ = gltf.view(image.bufferView)
            data = buffer[start : start + length]
        else:
            raise UserError("picture has neither a uri nor a buffer view", file=gltf.path, field=field)
        try:
            with Image.open(io.BytesIO(data)) as picture:
                if picture.width * picture.height > PIXELS_MAX:
                    got = f"{picture.width} x {picture.height}"
                    raise UserError("picture is too large", file=gltf.path, field=field, got=got, expected=PIXELS_MAX)
                picture.thumbnail((512, 512))
                texels = np.asarray(picture.convert("RGB"), float) / 255
        except (OSError, UnidentifiedImageError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
            raise UserError(f"picture cannot be read ({error})", file=gltf.path, field=field) from error
        if srgb:
            texels = np.where(texels <= 0.04045, texels / 12.92, ((texels + 0.055) / 1.055) ** 2.4)
        mean: Floats = texels.mean(axis=(0, 1))
        return mean


def material_of(document: MaterialDocument, name: str, textures: Textures) -> tuple[Material, Triple]:
    """The material, and the radiance it emits.

    mx = my = alpha_ggx = roughness^2 (glTF 2.0, appendix B); metals reflect their base colour and have no diffuse
    term; dielectrics reflect ((ior - 1)/(ior + 1))^2 and are diffuse below; between the two everything is blended.
    Transmission is that of a thin sheet. The exponent of the cosines keeps the albedo below one: see `_cosine_power`.
    """
    pbr, more = document.pbrMetallicRoughness, document.extensions
    base = np.asarray(pbr.baseColorFactor[:3]) * textures.mean(pbr.baseColorTexture, True, name)
    packed = textures.mean(pbr.metallicRoughnessTexture, False, name)
    metallic, roughness = pbr.metallicFactor * packed[2], pbr.roughnessFactor * packed[1]
    ior, specular = more.KHR_materials_ior.ior, more.KHR_materials_specular
    plain = ((ior - 1) / (ior + 1)) ** 2 * np.asarray(specular.specularColorFactor) * specular.specularFactor
    plain = np.clip(plain, 0, 1)
    r0 = (1 - metallic) * plain + metallic * base
    across = roughness**2
    strength = more.KHR_materials_anisotropy.anisotropyStrength
    along = across + (1 - across) * strength**2
    mx, my = (max(float(m), ROUGHNESS_MIN) for m in (along, across))
    power = _cosine_power(max(mx, my))
    lobes = [Lobe(distribution="ggx", mx=mx, my=my, r0=_triple(r0), alpha=power)]
    through = more.KHR_materials_transmission.transmissionFactor * (1 - metallic)
    if through > 0:
        k = _triple(through * base)
        lobes.append(lobes[0].model_copy(update={"side": "transmission", "k": k, "r0": _triple(plain)}))
    kd = base * (1 - metallic) * (1 - through) * (1 - plain)
    glow = np.asarray(document.emissiveFactor) * more.KHR_materials_emissive_strength.emissiveStrength
    if glow.any():
        glow = glow * textures.mean(document.emissiveTexture, True, name)
    return Material(name=name, kd=_triple(kd), lobes=tuple(lobes)), _triple(glow)


def _cosine_power(m: float) -> float:
    """Exponent of (cos_i cos_o): 1/2 on smooth surfaces, less on rough ones, where 1/2 would return too much light."""
    return 0.5 * min(1.0, math.sqrt(0.25 / m))


def _triple(values: Floats) -> Triple:
    r, g, b = (float(v) for v in values)
    return r, g, b
