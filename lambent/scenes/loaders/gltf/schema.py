"""The part of glTF 2.0 that Lambent reads; everything else in a file is ignored.

Fields of extensions and of small inner objects become fields of the enclosing object; `_at` gives their path.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import AliasPath, BaseModel, ConfigDict, Field

Finite = Annotated[float, Field(allow_inf_nan=False)]
Index = Annotated[int, Field(ge=0, le=1 << 53)]
Share = Annotated[float, Field(ge=0, le=1)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Three = tuple[Finite, Finite, Finite]
Four = tuple[Finite, Finite, Finite, Finite]
Colour = tuple[NotNegative, NotNegative, NotNegative]
READ_EXTENSIONS = {"KHR_mesh_quantization"}  # needs no field; `_extension` adds the others


def _at(*place: str, default: Any = ...) -> Any:
    """A field at a nested path, required by default."""
    return Field(default, validation_alias=AliasPath(*place))


def _extension(name: str, *place: str, default: Any = None) -> Any:
    """A field at a path within an extension."""
    READ_EXTENSIONS.add(name)
    return _at("extensions", name, *place, default=default)


class _Part(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)


class _Extended(_Part):
    extensions: dict[str, dict[str, Any]] = Field(default_factory=dict)


class Buffer(_Part):
    byteLength: Index
    uri: str | None = None


class BufferView(_Part):
    buffer: Index
    byteLength: Index
    byteOffset: Index = 0
    byteStride: Annotated[int, Field(ge=4, le=252)] | None = None


class Sparse(_Part):
    count: Index
    index_view: Index = _at("indices", "bufferView")
    index_offset: Index = _at("indices", "byteOffset", default=0)
    index_type: Literal[5121, 5123, 5125] = _at("indices", "componentType")
    value_view: Index = _at("values", "bufferView")
    value_offset: Index = _at("values", "byteOffset", default=0)


class Accessor(_Part):
    componentType: Literal[5120, 5121, 5122, 5123, 5125, 5126]
    count: Index
    type: Literal["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"]
    bufferView: Index | None = None
    byteOffset: Index = 0
    normalized: bool = False
    sparse: Sparse | None = None


class VariantMapping(_Part):
    material: Index
    variants: list[Index]


class Primitive(_Extended):
    attributes: dict[str, Index]
    indices: Index | None = None
    material: Index | None = None
    mode: Index = 4
    targets: list[dict[str, Index]] | None = None
    variants: list[VariantMapping] = _extension("KHR_materials_variants", "mappings", default=[])


class MeshDocument(_Part):
    primitives: list[Primitive]
    name: str | None = None
    weights: list[Finite] | None = None


class SkinDocument(_Part):
    joints: list[Index]
    inverseBindMatrices: Index | None = None


class Node(_Extended):
    name: str | None = None
    children: list[Index] = Field(default_factory=list)  # a factory: pydantic copies other defaults per node
    mesh: Index | None = None
    skin: Index | None = None
    weights: list[Finite] | None = None
    instances: dict[str, Index] | None = _extension("EXT_mesh_gpu_instancing", "attributes")
    camera: Index | None = None
    light: Index | None = _extension("KHR_lights_punctual", "light")
    luminaire: Index | None = _extension("EXT_lights_ies", "light")
    luminaire_multiplier: NotNegative = _extension("EXT_lights_ies", "multiplier", default=1.0)
    luminaire_color: Colour = _extension("EXT_lights_ies", "color", default=(1.0, 1.0, 1.0))
    matrix: Annotated[list[Finite], Field(min_length=16, max_length=16)] | None = None
    translation: Three = (0, 0, 0)
    rotation: Four = (0, 0, 0, 1)
    scale: Three = (1, 1, 1)


class Texture(_Extended):
    source: Index | None = None
    webp: Index | None = _extension("EXT_texture_webp", "source")
    sampler: Index | None = None

    @property
    def image(self) -> int | None:
        return self.source if self.webp is None else self.webp


class Sampler(_Part):
    wrapS: int = 10497
    wrapT: int = 10497


class Image(_Part):
    uri: str | None = None
    bufferView: Index | None = None


class TextureTransform(_Part):
    offset: tuple[Finite, Finite] = (0, 0)
    rotation: Finite = 0
    scale: tuple[Finite, Finite] = (1, 1)
    texCoord: Index | None = None


class TextureReference(_Extended):
    index: Index
    texCoord: Index = 0
    transform: TextureTransform | None = _extension("KHR_texture_transform")


class NormalReference(TextureReference):
    scale: Finite = 1


class MetallicRoughness(_Part):
    baseColorFactor: tuple[NotNegative, NotNegative, NotNegative, Share] = (1, 1, 1, 1)  # some exporters exceed 1
    metallicFactor: Share = 1
    roughnessFactor: Share = 1
    baseColorTexture: TextureReference | None = None
    metallicRoughnessTexture: TextureReference | None = None


class Specular(_Part):
    specularFactor: Share = 1
    specularColorFactor: Colour = (1, 1, 1)
    specularTexture: TextureReference | None = None
    specularColorTexture: TextureReference | None = None


class Anisotropy(_Part):
    anisotropyStrength: Share = 0
    anisotropyRotation: Finite = 0
    anisotropyTexture: TextureReference | None = None


class ClearCoat(_Part):
    clearcoatFactor: Share = 0
    clearcoatRoughnessFactor: Share = 0
    clearcoatTexture: TextureReference | None = None
    clearcoatRoughnessTexture: TextureReference | None = None
    clearcoatNormalTexture: TextureReference | None = None


class Transmission(_Part):
    transmissionFactor: Share = 0
    transmissionTexture: TextureReference | None = None


class DiffuseTransmission(_Part):
    diffuseTransmissionFactor: Share = 0
    diffuseTransmissionColorFactor: Colour = (1, 1, 1)
    diffuseTransmissionTexture: TextureReference | None = None
    diffuseTransmissionColorTexture: TextureReference | None = None


class Volume(_Part):
    thicknessFactor: NotNegative = 0
    attenuationDistance: Annotated[float, Field(gt=0)] = math.inf
    attenuationColor: Colour = (1, 1, 1)


class SpecularGlossiness(_Part):
    diffuseFactor: tuple[Share, Share, Share, Share] = (1, 1, 1, 1)
    specularFactor: tuple[Share, Share, Share] = (1, 1, 1)
    glossinessFactor: Share = 1
    diffuseTexture: TextureReference | None = None
    specularGlossinessTexture: TextureReference | None = None


class MaterialDocument(_Extended):
    name: str | None = None
    pbrMetallicRoughness: MetallicRoughness = MetallicRoughness()
    emissiveFactor: Colour = (0, 0, 0)
    emissiveTexture: TextureReference | None = None
    normalTexture: NormalReference | None = None
    alphaMode: Literal["OPAQUE", "MASK", "BLEND"] = "OPAQUE"
    alphaCutoff: NotNegative = 0.5
    emissive_strength: NotNegative = _extension("KHR_materials_emissive_strength", "emissiveStrength", default=1)
    ior: NotNegative = _extension("KHR_materials_ior", "ior", default=1.5)
    specular: Specular = _extension("KHR_materials_specular", default=Specular())
    anisotropy: Anisotropy = _extension("KHR_materials_anisotropy", default=Anisotropy())
    transmission: Transmission = _extension("KHR_materials_transmission", default=Transmission())
    clear_coat: ClearCoat = _extension("KHR_materials_clearcoat", default=ClearCoat())
    diffuse_transmission: DiffuseTransmission = _extension(
        "KHR_materials_diffuse_transmission", default=DiffuseTransmission()
    )
    volume: Volume = _extension("KHR_materials_volume", default=Volume())
    specular_glossiness: SpecularGlossiness | None = _extension("KHR_materials_pbrSpecularGlossiness")


class CameraDocument(_Part):
    type: str
    name: str | None = None
    yfov: float | None = _at("perspective", "yfov", default=None)


class SceneNodes(_Part):
    nodes: list[Index] = []


class LightDocument(_Part):
    name: str = ""
    type: Literal["directional", "point", "spot"]
    color: Colour = (1, 1, 1)
    intensity: NotNegative = 1
    inner_rad: NotNegative = _at("spot", "innerConeAngle", default=0)
    outer_rad: Annotated[float, Field(gt=0, le=1.5708)] = _at("spot", "outerConeAngle", default=0.7854)


class ProfileDocument(_Part):
    """An IES file."""

    name: str = ""
    uri: str | None = None
    bufferView: Index | None = None


class Variant(_Part):
    name: str


class GltfDocument(_Extended):
    """A whole glTF document."""

    version: str = _at("asset", "version")
    copyright: str = _at("asset", "copyright", default="")
    scene: Index = 0
    scenes: list[SceneNodes] = []
    nodes: list[Node] = []
    meshes: list[MeshDocument] = []
    skins: list[SkinDocument] = []
    accessors: list[Accessor] = []
    bufferViews: list[BufferView] = []
    buffers: list[Buffer] = []
    materials: list[MaterialDocument] = []
    textures: list[Texture] = []
    images: list[Image] = []
    samplers: list[Sampler] = []
    cameras: list[CameraDocument] = []
    lights: list[LightDocument] = _extension("KHR_lights_punctual", "lights", default=[])
    profiles: list[ProfileDocument] = _extension("EXT_lights_ies", "lights", default=[])
    variants: list[Variant] = _extension("KHR_materials_variants", "variants", default=[])
    extensionsRequired: list[str] = []
    extensionsUsed: list[str] = []
