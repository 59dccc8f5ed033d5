"""glTF's metallic-roughness materials as surfaces.

alpha_ggx = roughness^2 (glTF 2.0, appendix B); a dielectric reflects ((ior - 1)/(ior + 1))^2 at normal incidence.
Transmission is that of a thin sheet.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lambent.core.directions import Floats
from lambent.scenes.loaders.gltf_schema import MaterialDocument, SpecularGlossiness
from lambent.scenes.loaders.gltf_texture import Textures, main_uv_set
from lambent.scenes.loaders.metallic import metallic_roughness
from lambent.scenes.loaders.pictures import Picture
from lambent.scenes.loaders.surface import ROUGHNESS_MIN, Gloss, Surface, coated, rgb, seen_through
from lambent.scenes.loaders.varying import UvTransform, Varying, absolute, combined, constant, scaled
from lambent.scenes.scene import Texture, Triple


def surface_of(document: MaterialDocument, textures: Textures, said: list[str]) -> Surface:
    """The surface a material describes; `said` is told what it lost."""
    said += [f"not read: {name}" for name in sorted(document.extensions.model_extra or {})]
    older = document.extensions.KHR_materials_pbrSpecularGlossiness
    if older is not None and not document.pbrMetallicRoughness.model_fields_set:
        return _specular_glossiness(document, older, textures, said)
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
    plain = ((ior - 1) / (ior + 1)) ** 2 * np.asarray(specular.specularColorFactor)
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
    surface = metallic_roughness(
        base, metallic, along, plain, said, weight=specular.specularFactor, aspect=aspect, through=through
    )
    surface = _clear_coated(_translucent(surface, document, said), document, said)
    surface = replace(
        surface,
        normal=_normal(document, textures, uv_set, said),
        direction=direction,
        emission=_emission(document, textures, uv_set, said),
    )
    return _with_alpha(surface, document, found, said, pbr.baseColorFactor[3])


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


def _translucent(surface: Surface, document: MaterialDocument, said: list[str]) -> Surface:
    """With what a volume of its thickness leaves of the light that passes, and with diffuse transmission."""
    volume = document.extensions.KHR_materials_volume
    if volume.thicknessFactor and np.isfinite(volume.attenuationDistance):
        left = np.asarray(volume.attenuationColor) ** (volume.thicknessFactor / volume.attenuationDistance)
        tinted = (replace(g, k=scaled(g.k, left)) if g.side == "transmission" else g for g in surface.glosses)
        surface = replace(surface, glosses=tuple(tinted))
        said.append("its volume absorbs as a sheet of its thickness does")
    diffuse = document.extensions.KHR_materials_diffuse_transmission
    if not diffuse.diffuseTransmissionFactor:
        return surface
    if diffuse.diffuseTransmissionTexture is not None or diffuse.diffuseTransmissionColorTexture is not None:
        said.append("the textures of its diffuse transmission are not read")
    tone = float(np.mean(surface.kd.mean)) / max(
        float(np.mean(document.pbrMetallicRoughness.baseColorFactor[:3])), 1e-6
    )
    passed = diffuse.diffuseTransmissionFactor * min(tone, 1.0) * np.asarray(diffuse.diffuseTransmissionColorFactor)
    return replace(surface, kd=scaled(surface.kd, 1 - diffuse.diffuseTransmissionFactor), kt_d=constant(passed))


def _specular_glossiness(
    document: MaterialDocument, older: SpecularGlossiness, textures: Textures, said: list[str]
) -> Surface:
    """The archived extension: a diffuse colour below a coloured reflectance, roughness 1 - glossiness."""
    uv_set = main_uv_set(document)
    found = textures.of(older.diffuseTexture, uv_set, said)
    base = _times(np.asarray(older.diffuseFactor[:3]), found and Varying(found[0].rgb(srgb=True), found[1]))
    packed = textures.of(older.specularGlossinessTexture, uv_set, said)
    colour = _times(np.asarray(older.specularFactor), packed and Varying(packed[0].rgb(srgb=True), packed[1]))
    gloss = _times(np.array([older.glossinessFactor]), packed and Varying(packed[0].opacity(), packed[1]))
    r0 = np.clip(colour.highest, 0, 1)
    k = combined(lambda c: c / np.maximum(r0, 1e-6), colour, said=said) if colour.is_picture else constant(np.ones(3))
    kd = combined(lambda b, c: b * (1 - np.clip(c, 0, 1).max(axis=-1, keepdims=True)), base, colour, said=said)
    surface = Surface(kd=kd, coupled=True, glosses=(Gloss(combined(lambda g: (1 - g) ** 2, gloss, said=said), k, r0),))
    normal, glow = _normal(document, textures, uv_set, said), _emission(document, textures, uv_set, said)
    return _with_alpha(replace(surface, normal=normal, emission=glow), document, found, said, older.diffuseFactor[3])


def _clear_coated(surface: Surface, document: MaterialDocument, said: list[str]) -> Surface:
    coat = document.extensions.KHR_materials_clearcoat
    if not coat.clearcoatFactor:
        return surface
    if coat.clearcoatTexture or coat.clearcoatRoughnessTexture or coat.clearcoatNormalTexture:
        said.append("the textures of its clear coat are not read")
    k = constant(np.full(3, coat.clearcoatFactor))
    return coated(surface, Gloss(constant(coat.clearcoatRoughnessFactor**2), k, np.full(3, 0.04)))


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
    return rgb(glow)


def _with_alpha(
    surface: Surface,
    document: MaterialDocument,
    base: tuple[Picture, UvTransform] | None,
    said: list[str],
    factor: float,
) -> Surface:
    """With its holes (MASK), or with what shines through it (BLEND)."""
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
