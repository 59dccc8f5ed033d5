"""Textures of materials on the GPU. MIP levels average the following quantities:

diffuse, specular   bytes, sRGB encoded, times a scale per channel: half a step is less than the eye sees
roughness           squares, because variances of slopes add
normal              slopes, and twice the variance of the slopes within a texel (0 on level 0), which widens the
                    lobes (Olano & Baker 2010, "LEAN mapping", without the covariance)
direction           cosine and sine of the doubled angle
opacity             opacity, scaled so that on every level the same share of texels passes the cutoff (Castano
                    2010) and leaves keep their area; and the share of level-0 texels that pass, which is the
                    coverage of pixels larger than a texel
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.light.colour import srgb_encode
from lambent.realtime.gpu.uploads import half, upload
from lambent.scenes.looks.textures import CHANNELS, doubled_angle, halved, parts, slopes
from lambent.scenes.scene import MaterialTextures, Texture

KINDS = tuple(CHANNELS)  # order of the bindings, and of the bits of TEXTURES, in material.wgsl
BITS = {kind: 1 << i for i, kind in enumerate(KINDS)}
WIDENING = BITS["roughness"] | BITS["normal"]  # textures that make lobes wider
ROUGH_SHARE = 0.9  # quantile of a texture's roughness that sets the number of samples
_ALL_HALVES = np.arange(1 << 16, dtype=np.uint16).view(np.float16)


def chain(texels: Floats) -> list[Floats]:
    """Means (H, W, C) float32 of all levels down to one texel."""
    levels = [np.asarray(texels, np.float32)]
    while max(levels[-1].shape[:2]) > 1:
        levels.append(halved(levels[-1]))
    return levels


def normal_levels(normals: Floats) -> list[Floats]:
    """(H, W, 4): slopes along t and b, and twice their variances."""
    s = slopes(normals)
    return [
        np.concatenate([moments[..., :2], 2 * np.maximum(moments[..., 2:] - moments[..., :2] ** 2, 0)], axis=-1)
        for moments in chain(np.concatenate([s, s * s], axis=-1))
    ]


def opacity_levels(opacity: Floats, cutoff: float) -> list[Floats]:
    """MIP levels, scaled so that the same share of texels is at or above the cutoff on each."""
    levels = chain(opacity)
    share = float((levels[0] >= cutoff).mean())
    if not 0 < share < 1:
        return levels
    return [levels[0], *(_with_share(level, cutoff, share) for level in levels[1:])]


def _with_share(opacity: Floats, cutoff: float, share: float) -> Floats:
    """`opacity` times a factor for the given share; interpolated between texels, to be accurate on small levels."""
    ordered = np.sort(opacity, axis=None)[::-1]
    edge = np.interp(share * len(ordered), np.arange(len(ordered)) + 0.5, ordered)
    return np.asarray(opacity * np.float32(cutoff / max(float(edge), 1e-3)))


def encoded(texels: Floats) -> tuple[list[NDArray[np.uint8]], tuple[float, ...]]:
    """MIP levels (H, W, 4) as sRGB bytes, and the scale (3,) of their decoded values."""
    scale = np.maximum(texels.max(axis=(0, 1)).astype(float), 1e-6)
    with np.errstate(invalid="ignore"):
        relative = np.clip(np.nan_to_num(_ALL_HALVES.astype(float)[:, None] / scale), 0, 1)
    table = (srgb_encode(relative) * 255 + 0.5).astype(np.uint8)  # a look-up is faster than a power
    levels = []
    for level in chain(texels):
        bits = level.astype(np.float16).view(np.uint16)
        rgba = np.full((*level.shape[:2], 4), 255, np.uint8)
        rgba[..., :3] = table[bits, np.arange(3)]
        levels.append(rgba)
    return levels, tuple(float(x) for x in scale)


@dataclass(frozen=True)
class BoundTexture:
    """A texture's view; decoded texels count times `scale`."""

    view: Any
    scale: tuple[float, ...] = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class BoundTextures:
    """Textures in a material's bind group, in the order of KINDS; `bits` marks the ones that are not placeholders."""

    textures: tuple[BoundTexture, ...]
    bits: int = 0
    cutoff: float = 0.5
    lie: NDArray[np.float32] = field(default_factory=lambda: np.zeros((2 * len(KINDS), 4), np.float32))
    rough: float = 1.0  # factor on the roughness that ROUGH_SHARE of the texels do not exceed

    @property
    def masked(self) -> bool:
        return bool(self.bits & BITS["opacity"])

    def scale(self, kind: str) -> tuple[float, ...]:
        return self.textures[KINDS.index(kind)].scale


class TextureCache:
    """The textures of a scene, each on the GPU once."""

    def __init__(self, device: Any) -> None:
        self._device = device
        self._made: dict[tuple[str, int, float], BoundTexture] = {}
        self._kept: list[Any] = []  # arrays kept alive, because the cache identifies them by address
        self._none = BoundTexture(self._uploaded([np.full((1, 1, 4), 255, np.uint8)], "rgba8unorm"))
        self.sampler = device.create_sampler(
            mag_filter="linear", min_filter="linear", mipmap_filter="linear", address_mode_u="repeat",
            address_mode_v="repeat",
        )  # fmt: skip

    def of_material(self, textures: MaterialTextures | None) -> BoundTextures:
        """The textures of one material, with placeholders of one texel for missing ones."""
        there = parts(textures) if textures is not None else {}
        if textures is None or not there:
            return BoundTextures((self._none,) * len(KINDS))
        lie = np.zeros((2 * len(KINDS), 4), np.float32)
        for i, kind in enumerate(KINDS):
            if kind in there:
                lie[2 * i : 2 * i + 2, :3] = there[kind].uv_transform
        rough = float(np.quantile(there["roughness"].texels, ROUGH_SHARE)) if "roughness" in there else 1.0
        bound = tuple(self._texture(k, there[k], textures.cutoff) if k in there else self._none for k in KINDS)
        return BoundTextures(bound, sum(BITS[kind] for kind in there), textures.cutoff, lie, rough)

    def _texture(self, kind: str, texture: Texture, cutoff: float) -> BoundTexture:
        key = (kind, id(texture.texels), cutoff if kind == "opacity" else 0.0)
        if key not in self._made:
            self._kept.append(texture.texels)
            self._made[key] = self._new(kind, texture.texels, cutoff)
        return self._made[key]

    def _new(self, kind: str, texels: Floats, cutoff: float) -> BoundTexture:
        if kind in ("diffuse", "specular"):
            levels, scale = encoded(texels)
            return BoundTexture(self._uploaded(levels, "rgba8unorm-srgb"), scale)
        if kind == "normal":
            made = normal_levels(texels)
        elif kind == "direction":
            made = chain(doubled_angle(texels))
        elif kind == "opacity":
            covered = chain((np.asarray(texels) >= cutoff).astype(np.float32))
            made = [np.concatenate(both, axis=-1) for both in zip(opacity_levels(texels, cutoff), covered, strict=True)]
        else:
            made = [np.sqrt(level) for level in chain(np.square(texels, dtype=np.float32))]
        format = {1: "r16float", 2: "rg16float", 4: "rgba16float"}[made[0].shape[-1]]
        return BoundTexture(self._uploaded([half(level) for level in made], format))

    def _uploaded(self, levels: list[Any], format: str) -> Any:
        return upload(self._device, [level[None] for level in levels], format).create_view()


def bits_that_show(bits: int, lobes: int, anisotropic: bool) -> int:
    """Bits of the textures that shading reads: opacity is tested earlier; roughness and the like need lobes."""
    shown = bits & ~BITS["opacity"]
    if not lobes:
        return shown & (BITS["diffuse"] | BITS["normal"])
    return shown if anisotropic else shown & ~BITS["direction"]
