"""Surfaces as files describe them, and the materials and textures that are made of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from lambent.core.directions import Floats
from lambent.core.plain import Triple, triple
from lambent.materials.document import Lobe, Material
from lambent.scenes.loaders.surfaces.textured import Textured, combined, constant, relative, scaled
from lambent.scenes.scene import MaterialTextures, Texture

ROUGHNESS_MIN, ROUGHNESS_MAX = 0.003, 4.0  # slopes; below the first single precision loses the lobe
# Slope roughness; exponent of (cos_i cos_o) and coefficient of the lobe nearest to the same distribution under Smith's
# masking, by least difference of f cos and of the albedo, weighted by the cosine. The albedo of a white lobe stays
# below 1 up to 82 degrees and is at most 1.1 at 87.
MASKED = {
    "ggx": (
        (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0, 1.4),
        (0.5, 0.5, 0.488, 0.471, 0.441, 0.413, 0.388, 0.351, 0.322, 0.278, 0.236, 0.182, 0.137, 0.002),
        (1.0, 1.007, 1.022, 1.039, 1.062, 1.084, 1.102, 1.116, 1.112, 1.113, 1.106, 1.081, 1.043, 0.958),
    ),
    "beckmann": (
        (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0, 1.4, 2.0),
        (0.5, 0.502, 0.507, 0.509, 0.487, 0.464, 0.441, 0.391, 0.344, 0.309, 0.277, 0.241, 0.217, 0.201, 0.148),
        (1.0, 1.001, 1.002, 1.011, 1.022, 1.038, 1.061, 1.135, 1.215, 1.261, 1.305, 1.349, 1.361, 1.255, 1.077),
    ),
}  # fmt: skip
BLACK = np.zeros(3)
Distribution = Literal["beckmann", "ggx"]


@dataclass(frozen=True)
class SpecularLobe:
    """One lobe of slope roughness `m` along t and `m` times `aspect` across, coefficient `k` and reflectance `r0` (3,).

    `masked` is whether the format multiplies it by Smith's masking. Its albedo has a further factor cos_o^falloff.
    """

    m: Textured
    k: Textured
    r0: Floats
    aspect: float = 1.0
    side: Literal["reflection", "transmission"] = "reflection"
    distribution: Distribution = "ggx"
    masked: bool = True
    falloff: float = 0.0


@dataclass(frozen=True)
class Surface:
    """Diffuse reflection (coupled to Fresnel or not), diffuse transmission, lobes, textures of normals and masks."""

    kd: Textured = field(default_factory=lambda: constant(BLACK))
    coupled: bool = False
    kt_d: Textured = field(default_factory=lambda: constant(BLACK))
    lobes: tuple[SpecularLobe, ...] = ()
    normal: Texture | None = None
    direction: Texture | None = None
    opacity: Texture | None = None
    cutoff: float = 0.5
    emission: Triple = (0.0, 0.0, 0.0)


def finished(name: str, surface: Surface, notes: list[str]) -> tuple[Material, MaterialTextures | None]:
    """Material document and textures of a surface; None where nothing varies.

    The document holds the means, so that it is right without its textures. Lobes share one texture of coefficients and
    one of roughness: where they differ the first is used, which is noted.
    """
    kd, diffuse = relative(surface.kd, surface.opacity)
    kt_d, through = relative(surface.kt_d, surface.opacity)
    if max(*kd, *kt_d) > 1:
        notes.append(f"reflects more than arrives ({max(*kd, *kt_d):.3g}): all of it")
        kd, kt_d = np.minimum(kd, 1), np.minimum(kt_d, 1)
    if diffuse is not None and through is not None and not _same(diffuse, through):
        notes.append("its diffuse transmission varies as its diffuse reflection does")
    lobes, shades, slopes = [], [], []
    for lobe in surface.lobes:
        k, shade = relative(lobe.k, surface.opacity)
        m, slope = relative(lobe.m, surface.opacity)
        shades.append(shade)
        slopes.append(slope)
        mx, my = (min(max(float(v), ROUGHNESS_MIN), ROUGHNESS_MAX) for v in (m[0], m[0] * lobe.aspect))
        alpha, share = masking(mx, my, lobe.distribution) if lobe.masked else (0.5, 1.0)
        if lobe.masked and lobe.m.is_texture:  # where it is smoothest, its albedo must not exceed 1
            least = float(lobe.m.values.min())
            share = min(share, masking(least, least * lobe.aspect, lobe.distribution)[1])
        alpha = min(max(alpha - lobe.falloff / 2, 0.0), 1.0)
        lobes.append(
            Lobe(
                side=lobe.side,
                distribution=lobe.distribution,
                k=rgb(k * share),
                mx=mx,
                my=my,
                r0=rgb(np.clip(lobe.r0, 0, 1)),
                alpha=alpha,
            )
        )
    textures = MaterialTextures(
        diffuse=_rgb(diffuse or through),
        specular=_rgb(_shared(shades, "colours", notes)),
        roughness=_shared(slopes, "roughness", notes),
        normal=surface.normal,
        direction=surface.direction,
        opacity=surface.opacity,
        cutoff=surface.cutoff,
    )
    coupled = surface.coupled and any(kd)
    material = Material(name=name, kd=rgb(kd), kd_coupled=coupled, kt_d=rgb(kt_d), lobes=tuple(lobes))
    varies = textures != MaterialTextures(cutoff=textures.cutoff)
    return material, textures if varies else None


class MadeMaterials:
    """The materials of one file, each made when it is first used."""

    def __init__(self, notes: list[str] | None = None) -> None:
        self.materials: dict[str, Material] = {}
        self.textures: dict[str, MaterialTextures] = {}
        self.emission: dict[str, Triple] = {}
        self.notes = [] if notes is None else notes

    def make(self, name: str, surface_of: Callable[[list[str]], Surface]) -> None:
        """Make the material of a name, if not made; `surface_of` takes a list for its notes."""
        if name in self.materials:
            return
        notes: list[str] = []
        surface = surface_of(notes)
        self.materials[name], textures = finished(name, surface, notes)
        if textures is not None:
            self.textures[name] = textures
        self.emission[name] = surface.emission
        self.notes += [f"material {name}: {text}" for text in dict.fromkeys(notes)]


def masking(mx: float, my: float, distribution: Distribution) -> tuple[float, float]:
    """Exponent of (cos_i cos_o) and coefficient of the lobe that replaces a masked one of these slopes."""
    m, alpha, k = MASKED[distribution]
    return float(np.interp([mx, my], m, alpha).mean()), float(np.interp([mx, my], m, k).mean())


def seen_through(surface: Surface, opacity: Floats) -> Surface:
    """A surface that covers a share (3,) of the background; the rest of the light goes straight through."""
    held = constant(opacity)

    def part(v: Textured) -> Textured:
        return combined(lambda a, b: a * b, v, held, notes=[])

    lobes = tuple(replace(lobe, k=part(lobe.k)) for lobe in surface.lobes)
    return replace(surface, kd=part(surface.kd), kt_d=part(surface.kt_d), lobes=(*lobes, straight_through(1 - opacity)))


def coated(surface: Surface, coat: SpecularLobe) -> Surface:
    """A surface below a clear coat, which takes the light that it reflects: more at grazing incidence.

    1 - k F is nearly (1 - k r0) cos^(k/4) up to 80 degrees: lobes get that factor, the diffuse term is coupled.
    """
    share = float(np.clip(coat.k.mean.mean(), 0, 1))
    left = 1 - share * float(np.mean(coat.r0))
    under = tuple(replace(lobe, k=scaled(lobe.k, left), falloff=lobe.falloff + share / 4) for lobe in surface.lobes)
    coupled = surface.coupled or share > 0.5
    return replace(surface, kd=scaled(surface.kd, left), coupled=coupled, lobes=(*under, coat))


def straight_through(k: Floats) -> SpecularLobe:
    """A share k (3,) of the light goes on undeflected: the narrowest lobe of transmission.

    Such a lobe falls as 1 - (1 - cos)^5 whatever its r0; the exponent compensates up to 60 degrees.
    """
    return SpecularLobe(constant(ROUGHNESS_MIN), constant(k), BLACK, side="transmission", masked=False, falloff=-0.04)


def blended(parts: Sequence[tuple[Surface, float]], notes: list[str]) -> Surface:
    """Sum of surfaces, each weighted by its share; normal map and mask are those of the first."""
    first = parts[0][0]
    kd, kt_d = constant(BLACK), constant(BLACK)
    lobes: list[SpecularLobe] = []
    coupled = 0.0
    for surface, share in parts:
        kd = combined(np.add, scaled(surface.kd, share), kd, notes=notes)
        kt_d = combined(np.add, scaled(surface.kt_d, share), kt_d, notes=notes)
        lobes += [replace(lobe, k=scaled(lobe.k, share)) for lobe in surface.lobes]
        coupled += float(surface.kd.mean.mean()) * share * (1 if surface.coupled else -1)
    return replace(first, kd=kd, kt_d=kt_d, coupled=coupled > 0, lobes=tuple(lobes))


def _shared(found: Sequence[Texture | None], what: str, notes: list[str]) -> Texture | None:
    """One texture for all lobes."""
    textures = [t for t in found if t is not None]
    if not textures:
        return None
    if any(t is None or not _same(t, textures[0]) for t in found):
        notes.append(f"the {what} of its lobes vary in different ways: all follow the first that does")
    return textures[0]


def _rgb(texture: Texture | None) -> Texture | None:
    if texture is None or texture.texels.shape[-1] == 3:
        return texture
    return replace(texture, texels=np.repeat(texture.texels, 3, axis=-1))


def _same(a: Texture, b: Texture) -> bool:
    if a.uv_transform != b.uv_transform or a.texels.shape != b.texels.shape:
        return False
    return a.texels is b.texels or bool(np.array_equal(a.texels, b.texels))


def normal_reflectance(ior: float) -> float:
    """Reflectance of a dielectric at normal incidence."""
    return ((ior - 1) / (ior + 1)) ** 2


def rgb(values: Floats) -> Triple:
    """(r, g, b) of three numbers, or of one for all."""
    return triple(np.broadcast_to(values, 3))
