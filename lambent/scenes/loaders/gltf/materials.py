"""glTF's textures, and its materials as surfaces: metallic-roughness with its extensions, and specular-glossiness.

alpha_ggx = roughness^2 (glTF 2.0, appendix B); a dielectric reflects ((ior - 1)/(ior + 1))^2 at normal incidence.
Transmission is that of a thin sheet.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from lambent.core.errors import UserError
from lambent.core.plain import Triple
from lambent.materials.fresnel import r0_of
from lambent.scenes.loaders.gltf.container import Gltf, is_remote
from lambent.scenes.loaders.gltf.schema import READ_EXTENSIONS, MaterialDocument, SpecularGlossiness, TextureReference
from lambent.scenes.loaders.surfaces.material_builder import TextureImage, TextureImages
from lambent.scenes.loaders.surfaces.surface import ROUGHNESS_MIN, SpecularLobe, Surface, metallic_roughness, rgb
from lambent.scenes.loaders.surfaces.textured import Textured, absolute, combined, constant, flipped_uv, scaled
from lambent.scenes.scene import IDENTITY, Texture, UvTransform

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


def surface_of(document: MaterialDocument, textures: Textures, notes: list[str]) -> Surface:
    """The surface that a material describes; `notes` gets a line about everything lost."""
    notes += [f"ignored: {name}" for name in sorted(set(document.extensions) - READ_EXTENSIONS)]
    reading = _Reading(document, textures, notes)
    older = document.specular_glossiness
    if older is not None and not document.pbrMetallicRoughness.model_fields_set:
        return reading.specular_glossiness(older)
    return reading.metallic_roughness()


class _Reading:
    """State of converting one material to a surface."""

    def __init__(self, document: MaterialDocument, textures: Textures, notes: list[str]) -> None:
        self._document, self._textures, self._notes = document, textures, notes
        self._uv_set = main_uv_set(document)

    def metallic_roughness(self) -> Surface:
        document, notes = self._document, self._notes
        pbr, specular, transmission = document.pbrMetallicRoughness, document.specular, document.transmission
        image = self._image(pbr.baseColorTexture)
        factor = np.array(pbr.baseColorFactor[:3])
        if factor.max() > 1:
            notes.append(f"its base colour reflects more light than arrives ({factor.max():.3g}): clipped to 1")
        base = _times(np.minimum(factor, 1), _srgb(image))
        packed = self._values(pbr.metallicRoughnessTexture)
        metallic = _times([pbr.metallicFactor], packed and packed.channel(2))
        roughness = _times([pbr.roughnessFactor], packed and packed.channel(1))
        across = combined(lambda r: r**2, roughness, notes=notes)
        # ior = 0 is specified to mean no Fresnel effect: r0 = 1, which the specular colour scales.
        plain = r0_of(document.ior) * np.asarray(specular.specularColorFactor)
        if specular.specularTexture is not None or specular.specularColorTexture is not None:
            notes.append("textures of its specular extension are ignored")
        strength, direction = self._anisotropy()
        along = combined(lambda a: a + (1 - a) * strength**2, across, notes=notes) if strength else across
        aspect = float(max(across.mean[0], ROUGHNESS_MIN) / max(along.mean[0], ROUGHNESS_MIN))
        through = transmission.transmissionFactor
        if through and transmission.transmissionTexture is not None:
            texture = self._values(transmission.transmissionTexture)
            through *= float(texture.channel(0).mean[0]) if texture is not None else 1.0
            notes.append("its transmission is averaged over its texture")
        surface = metallic_roughness(
            base, metallic, along, plain, notes,
            weight=specular.specularFactor, aspect=aspect, through=through, by_half_vector=True,
        )  # fmt: skip
        surface = replace(self._clear_coated(self._translucent(surface)), direction=direction)
        return self._finished(surface, image, pbr.baseColorFactor[3])

    def specular_glossiness(self, older: SpecularGlossiness) -> Surface:
        """The archived extension: a diffuse colour below a coloured reflectance, roughness 1 - glossiness."""
        notes = self._notes
        image = self._image(older.diffuseTexture)
        base = _times(older.diffuseFactor[:3], _srgb(image))
        packed = self._image(older.specularGlossinessTexture)
        colour = _times(older.specularFactor, _srgb(packed))
        gloss = _times([older.glossinessFactor], None if packed is None else packed.opacity())
        r0, k = np.clip(colour.highest, 0, 1), constant(np.ones(3))
        if colour.is_texture:
            k = combined(lambda c: c / np.maximum(r0, 1e-6), colour, notes=notes)
        kd = combined(lambda b, c: b * (1 - np.clip(c, 0, 1).max(axis=-1, keepdims=True)), base, colour, notes=notes)
        lobe = SpecularLobe(combined(lambda g: (1 - g) ** 2, gloss, notes=notes), k, r0)
        return self._finished(Surface(kd=kd, coupled=True, lobes=(lobe,)), image, older.diffuseFactor[3])

    def _image(self, reference: TextureReference | None) -> TextureImage | None:
        return self._textures.of(reference, self._uv_set, self._notes)

    def _values(self, reference: TextureReference | None, *, srgb: bool = False) -> Textured | None:
        return self._textures.rgb(reference, self._uv_set, self._notes, srgb=srgb)

    def _finished(self, surface: Surface, base: TextureImage | None, opacity: float) -> Surface:
        """Add what both kinds of material share: a normal map, emission, and the alpha of the base colour."""
        return self._with_alpha(replace(surface, normal=self._normal(), emission=self._emission()), base, opacity)

    def _anisotropy(self) -> tuple[float, Texture | None]:
        """Strength, and a texture of the rotation angles of the tangent."""
        anisotropy = self._document.anisotropy
        strength, turn_rad = anisotropy.anisotropyStrength, anisotropy.anisotropyRotation
        if not strength:
            return 0.0, None
        turned = np.array([np.cos(turn_rad), np.sin(turn_rad)])
        texture = self._values(anisotropy.anisotropyTexture)
        if texture is None:
            return strength, (absolute(constant(turned)) if turn_rad else None)
        if float(np.ptp(texture.values[..., 2])) > 0.02:
            self._notes.append("the strength of its anisotropy is averaged over its texture")
        strength *= float(texture.channel(2).mean[0])
        x, y = (texture.values[..., i] * 2 - 1 for i in range(2))
        length = np.maximum(np.hypot(x, y), 1e-3)
        x, y = x / length, y / length
        directions = np.stack([x * turned[0] - y * turned[1], x * turned[1] + y * turned[0]], axis=-1)
        return strength, absolute(Textured(directions, texture.uv_transform))

    def _translucent(self, surface: Surface) -> Surface:
        """Add the absorption of its volume and its diffuse transmission."""
        volume = self._document.volume
        if volume.thicknessFactor and np.isfinite(volume.attenuationDistance):
            left = np.asarray(volume.attenuationColor) ** (volume.thicknessFactor / volume.attenuationDistance)
            tinted = (replace(g, k=scaled(g.k, left)) if g.side == "transmission" else g for g in surface.lobes)
            surface = replace(surface, lobes=tuple(tinted))
            self._notes.append("its volume becomes a sheet of its thickness")
        diffuse = self._document.diffuse_transmission
        if not diffuse.diffuseTransmissionFactor:
            return surface
        if diffuse.diffuseTransmissionTexture is not None or diffuse.diffuseTransmissionColorTexture is not None:
            self._notes.append("textures of its diffuse transmission are ignored")
        factor = self._document.pbrMetallicRoughness.baseColorFactor[:3]
        tone = float(np.mean(surface.kd.mean)) / max(float(np.mean(factor)), 1e-6)
        passed = diffuse.diffuseTransmissionFactor * min(tone, 1.0) * np.asarray(diffuse.diffuseTransmissionColorFactor)
        return replace(surface, kd=scaled(surface.kd, 1 - diffuse.diffuseTransmissionFactor), kt_d=constant(passed))

    def _clear_coated(self, surface: Surface) -> Surface:
        coat = self._document.clear_coat
        if not coat.clearcoatFactor:
            return surface
        if coat.clearcoatTexture or coat.clearcoatRoughnessTexture or coat.clearcoatNormalTexture:
            self._notes.append("textures of its clear coat are ignored")
        k = constant(np.full(3, coat.clearcoatFactor))
        return surface.coated(SpecularLobe(constant(coat.clearcoatRoughnessFactor**2), k, np.full(3, 0.04)))

    def _normal(self) -> Texture | None:
        reference = self._document.normalTexture
        texture = self._values(reference)
        if texture is None or reference is None:
            return None
        normals = (texture.values * 2 - 1) * np.array([reference.scale, reference.scale, 1.0], np.float32)
        length = np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-3)
        return absolute(Textured(normals / length, texture.uv_transform))

    def _emission(self) -> Triple:
        radiance = np.asarray(self._document.emissiveFactor) * self._document.emissive_strength
        if not radiance.any():
            return 0.0, 0.0, 0.0
        texture = self._values(self._document.emissiveTexture, srgb=True)
        if texture is not None:
            self._notes.append("its emission is averaged over its texture")
            radiance = radiance * texture.mean
        return rgb(radiance)

    def _with_alpha(self, surface: Surface, base: TextureImage | None, factor: float) -> Surface:
        """Add its holes (MASK), or its transparency (BLEND)."""
        mode, cutoff = self._document.alphaMode, self._document.alphaCutoff
        if mode == "OPAQUE":
            return surface
        alpha = _times([factor], base.opacity() if base is not None and base.alpha else None)
        if mode == "MASK":
            if alpha.is_texture or factor < cutoff:
                return replace(surface, opacity=absolute(alpha), cutoff=cutoff)
            return surface
        even = float(alpha.mean[0])
        if alpha.is_texture and float(np.ptp(alpha.values)) > 0.02:
            self._notes.append("alpha BLEND becomes a cut-out at .5")
            return replace(surface, opacity=absolute(alpha))
        if even >= 1:
            return surface
        self._notes.append(f"alpha BLEND lets {1 - even:.0%} of the light through")
        return surface.with_opacity(np.full(3, even))


def _srgb(image: TextureImage | None) -> Textured | None:
    return None if image is None else image.rgb(srgb=True)


def _times(factor: ArrayLike, v: Textured | None) -> Textured:
    return constant(factor) if v is None else scaled(v, np.asarray(factor, float))
