"""glTF's metallic-roughness materials as surfaces.

alpha_ggx = roughness^2 (glTF 2.0, appendix B); a dielectric reflects ((ior - 1)/(ior + 1))^2 at normal incidence.
Transmission is that of a thin sheet.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lambent.core.frames import Floats
from lambent.scenes.loaders.gltf_schema import MaterialDocument
from lambent.scenes.loaders.gltf_texture import Textures, main_uv_set
from lambent.scenes.loaders.metallic import metallic_roughness
from lambent.scenes.loaders.pictures import Picture
from lambent.scenes.loaders.surface import ROUGHNESS_MIN, Gloss, Surface, seen_through, triple
from lambent.scenes.loaders.varying import UvTransform, Varying, absolute, combined, constant
from lambent.scenes.scene import Texture, Triple


def surface_of(document: MaterialDocument, textures: Textures, said: list[str]) -> Surface:
    """The surface a material describes; `said` is told what it lost."""
    pbr, more = document.pbrMetallicRoughness, document.extensions
    uv_set = main_uv_set(document)
    found = textures.of(pbr.baseColorTexture, uv_set, said)
    base = _times(np.asarray(pbr.baseColorFactor[:3]), found and Varying(found[0].rgb(srgb=True), found[1]))
    packed = textures.rgb(pbr.metallicRoughnessTexture, uv_set, said, srgb=False)
    metallic = _times(np.array([pbr.metallicFactor]), packed and packed.channel(2))
    roughness = _times(np.array([pbr.roughnessFactor]), packed and packed.channel(1))
    across = combined(lambda r: r**2, roughness, said=said)
    ior, specular = more.KHR_materials_ior.ior, more.KHR_materials_specular
    # Such an ior is specified to mean no Fresnel effect at all; at most everything is reflected.
    plain = ((ior - 1) / (ior + 1)) ** 2 * np.asarray(specular.specularColorFactor) * specular.specularFactor
    if specular.specularTexture is not None or specular.specularColorTexture is not None:
        said.append("the textures of its specular extension are not read")
    strength, direction = _anisotropy(document, textures, uv_set, said)
    along = combined(lambda a: a + (1 - a) * strength**2, across, said=said) if strength else across
    aspect = float(max(across.mean[0], ROUGHNESS_MIN) / max(along.mean[0], ROUGHNESS_MIN))
    through = more.KHR_materials_transmission.transmissionFactor
    if through and more.KHR_materials_transmission.transmissionTexture is not None:
        mean = textures.rgb(more.KHR_materials_transmission.transmissionTexture, uv_set, said, srgb=False)
        through *= float(mean.channel(0).mean[0]) if mean is not None else 1.0
        said.append("its transmission is averaged over its picture")
    surface = metallic_roughness(base, metallic, along, plain, said, aspect=aspect, through=through)
    surface = replace(
        surface,
        glosses=(*surface.glosses, *_clear_coat(document)),
        normal=_normal(document, textures, uv_set, said),
        direction=direction,
        emission=_emission(document, textures, uv_set, said),
    )
    return _with_alpha(surface, document, found, said)


def _times(factor: Floats, v: Varying | None) -> Varying:
    if v is None:
        return constant(factor)
    return Varying(v.values * factor.astype(np.float32), v.uv_transform)


def _anisotropy(
    document: MaterialDocument, textures: Textures, uv_set: int, said: list[str]
) -> tuple[float, Texture | None]:
    """Strength, and by which angles the tangent is turned."""
    anisotropy = document.extensions.KHR_materials_anisotropy
    strength, turn_rad = anisotropy.anisotropyStrength, anisotropy.anisotropyRotation
    if not strength:
        return 0.0, None
    turned = np.array([np.cos(turn_rad), np.sin(turn_rad)])
    picture = textures.rgb(anisotropy.anisotropyTexture, uv_set, said, srgb=False)
    if picture is None:
        return strength, (absolute(constant(turned)) if turn_rad else None)
    if float(np.ptp(picture.values[..., 2])) > 0.02:
        said.append("the strength of its anisotropy is averaged over its picture")
    strength *= float(picture.channel(2).mean[0])
    x, y = (picture.values[..., i] * 2 - 1 for i in range(2))
    length = np.maximum(np.hypot(x, y), 1e-3)
    x, y = x / length, y / length
    directions = np.stack([x * turned[0] - y * turned[1], x * turned[1] + y * turned[0]], axis=-1)
    return strength, absolute(Varying(directions, picture.uv_transform))


def _clear_coat(document: MaterialDocument) -> tuple[Gloss, ...]:
    coat = document.extensions.KHR_materials_clearcoat
    if not coat.clearcoatFactor:
        return ()
    k = constant(np.full(3, coat.clearcoatFactor))
    return (Gloss(constant(coat.clearcoatRoughnessFactor**2), k, np.full(3, 0.04)),)


def _normal(document: MaterialDocument, textures: Textures, uv_set: int, said: list[str]) -> Texture | None:
    reference = document.normalTexture
    picture = textures.rgb(reference, uv_set, said, srgb=False)
    if picture is None or reference is None:
        return None
    strength = np.array([reference.scale, reference.scale, 1.0], np.float32)
    normals = (picture.values * 2 - 1) * strength
    length = np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-3)
    return absolute(Varying(normals / length, picture.uv_transform))


def _emission(document: MaterialDocument, textures: Textures, uv_set: int, said: list[str]) -> Triple:
    glow = np.asarray(document.emissiveFactor) * document.extensions.KHR_materials_emissive_strength.emissiveStrength
    if not glow.any():
        return 0.0, 0.0, 0.0
    picture = textures.rgb(document.emissiveTexture, uv_set, said, srgb=True)
    if picture is not None:
        said.append("its emission is averaged over its picture")
        glow = glow * picture.mean
    return triple(glow)


def _with_alpha(
    surface: Surface, document: MaterialDocument, base: tuple[Picture, UvTransform] | None, said: list[str]
) -> Surface:
    """With its holes (MASK), or with what shines through it (BLEND)."""
    factor = document.pbrMetallicRoughness.baseColorFactor[3]
    if document.alphaMode == "OPAQUE":
        return surface
    alpha = Varying(base[0].opacity() * np.float32(factor), base[1]) if base and base[0].alpha else constant(factor)
    if document.alphaMode == "MASK":
        if alpha.is_picture or factor < document.alphaCutoff:
            return replace(surface, opacity=absolute(alpha), cutoff=document.alphaCutoff)
        return surface
    even = float(alpha.mean[0])
    if alpha.is_picture and float(np.ptp(alpha.values)) > 0.02:
        said.append("alpha BLEND cuts holes where it is below a half")
        return replace(surface, opacity=absolute(alpha))
    if even >= 1:
        return surface
    said.append(f"alpha BLEND lets {1 - even:.0%} of the light through")
    return seen_through(surface, np.full(3, even))
