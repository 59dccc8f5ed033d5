"""A surface as a file describes it, on its way to a material and its textures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from lambent.core.directions import Floats
from lambent.core.plain import triple
from lambent.materials.document import Lobe, Material
from lambent.scenes.loaders.varying import Varying, combined, constant, relative, scaled
from lambent.scenes.scene import MaterialTextures, Texture, Triple

ROUGHNESS_MIN, ROUGHNESS_MAX = 0.003, 4.0  # slopes; below the first single precision loses the lobe
# Slope roughness, exponent of (cos_i cos_o) and coefficient of the lobe nearest to the same distribution under Smith's
# masking: least difference of f cos and of the albedo, weighed by the cosine. What reflects everything returns no more
# than arrives at up to 82 degrees, and at 87 at most a tenth more.
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
class Gloss:
    """One lobe: slope roughness `m` along t, times `aspect` across; coefficient k; r0, at normal incidence.

    `masked` says that Smith's masking belongs to it. Its albedo has a further factor, cos_o to the power of `falloff`.
    """

    m: Varying
    k: Varying
    r0: Floats
    aspect: float = 1.0
    side: Literal["reflection", "transmission"] = "reflection"
    distribution: Distribution = "ggx"
    masked: bool = True
    falloff: float = 0.0


@dataclass(frozen=True)
class Surface:
    """Diffuse reflection (coupled to Fresnel or not), diffuse transmission, lobes, and what modulates them."""

    kd: Varying = field(default_factory=lambda: constant(BLACK))
    coupled: bool = False
    kt_d: Varying = field(default_factory=lambda: constant(BLACK))
    glosses: tuple[Gloss, ...] = ()
    normal: Texture | None = None
    direction: Texture | None = None
    opacity: Texture | None = None
    cutoff: float = 0.5
    emission: Triple = (0.0, 0.0, 0.0)


def finished(name: str, surface: Surface, said: list[str]) -> tuple[Material, MaterialTextures | None]:
    """Material document and textures of a surface; None where nothing varies.

    The document holds the means, so that it is right without its textures. Lobes share a texture of their coefficients
    and one of their roughness: where theirs differ the first holds, and `said` is told.
    """
    kd, diffuse = relative(surface.kd, surface.opacity)
    kt_d, through = relative(surface.kt_d, surface.opacity)
    if max(*kd, *kt_d) > 1:
        said.append(f"reflects more than arrives ({max(*kd, *kt_d):.3g}): all of it")
        kd, kt_d = np.minimum(kd, 1), np.minimum(kt_d, 1)
    if diffuse is not None and through is not None and not _same(diffuse, through):
        said.append("its diffuse transmission varies as its diffuse reflection does")
    lobes, shades, slopes = [], [], []
    for gloss in surface.glosses:
        k, shade = relative(gloss.k, surface.opacity)
        m, slope = relative(gloss.m, surface.opacity)
        shades.append(shade)
        slopes.append(slope)
        mx, my = (min(max(float(v), ROUGHNESS_MIN), ROUGHNESS_MAX) for v in (m[0], m[0] * gloss.aspect))
        alpha, share = masking(mx, my, gloss.distribution) if gloss.masked else (0.5, 1.0)
        if gloss.masked and gloss.m.is_picture:  # where it is smoothest it must not return more than arrives
            least = float(gloss.m.values.min())
            share = min(share, masking(least, least * gloss.aspect, gloss.distribution)[1])
        alpha = min(max(alpha - gloss.falloff / 2, 0.0), 1.0)
        lobes.append(
            Lobe(
                side=gloss.side,
                distribution=gloss.distribution,
                k=rgb(k * share),
                mx=mx,
                my=my,
                r0=rgb(np.clip(gloss.r0, 0, 1)),
                alpha=alpha,
            )
        )
    textures = MaterialTextures(
        diffuse=_rgb(diffuse or through),
        specular=_rgb(_shared(shades, "colours", said)),
        roughness=_shared(slopes, "roughness", said),
        normal=surface.normal,
        direction=surface.direction,
        opacity=surface.opacity,
        cutoff=surface.cutoff,
    )
    coupled = surface.coupled and any(kd)
    material = Material(name=name, kd=rgb(kd), kd_coupled=coupled, kt_d=rgb(kt_d), lobes=tuple(lobes))
    varies = textures != MaterialTextures(cutoff=textures.cutoff)
    return material, textures if varies else None


def masking(mx: float, my: float, distribution: Distribution) -> tuple[float, float]:
    """Exponent of (cos_i cos_o) and coefficient of a lobe that stands for a masked one of these slopes."""
    m, alpha, k = MASKED[distribution]
    return float(np.interp([mx, my], m, alpha).mean()), float(np.interp([mx, my], m, k).mean())


def seen_through(surface: Surface, opacity: Floats) -> Surface:
    """A surface that covers a share (3,) of what is behind it; the rest goes straight through."""
    held = constant(opacity)

    def part(v: Varying) -> Varying:
        return combined(lambda a, b: a * b, v, held, said=[])

    glosses = tuple(replace(g, k=part(g.k)) for g in surface.glosses)
    return replace(
        surface, kd=part(surface.kd), kt_d=part(surface.kt_d), glosses=(*glosses, straight_through(1 - opacity))
    )


def coated(surface: Surface, coat: Gloss) -> Surface:
    """A surface below a clear coat: it loses what the coat reflects, more of it the flatter light arrives.

    1 - k F is nearly (1 - k r0) cos^(k/4) as far as 80 degrees: lobes get that factor, the diffuse term is coupled.
    """
    share = float(np.clip(coat.k.mean.mean(), 0, 1))
    left = 1 - share * float(np.mean(coat.r0))
    under = tuple(replace(g, k=scaled(g.k, left), falloff=g.falloff + share / 4) for g in surface.glosses)
    coupled = surface.coupled or share > 0.5
    return replace(surface, kd=scaled(surface.kd, left), coupled=coupled, glosses=(*under, coat))


def straight_through(k: Floats) -> Gloss:
    """Light that goes on as it came, a share k (3,) of it: the narrowest lobe there is.

    A lobe of transmission falls as 1 - (1 - cos)^5 whatever its r0; the exponent makes up for it as far as 60 degrees.
    """
    return Gloss(constant(ROUGHNESS_MIN), constant(k), BLACK, side="transmission", masked=False, falloff=-0.04)


def blended(parts: Sequence[tuple[Surface, float]], said: list[str]) -> Surface:
    """Sum of surfaces, each with its share; the first normal map and mask hold."""
    first = parts[0][0]
    kd, kt_d = constant(BLACK), constant(BLACK)
    glosses: list[Gloss] = []
    coupled = 0.0
    for surface, share in parts:

        def weighed(v: Varying, share: float = share) -> Varying:
            return Varying(v.values * share, v.uv_transform)

        kd = combined(np.add, weighed(surface.kd), kd, said=said)
        kt_d = combined(np.add, weighed(surface.kt_d), kt_d, said=said)
        glosses += [replace(g, k=weighed(g.k)) for g in surface.glosses]
        coupled += float(surface.kd.mean.mean()) * share * (1 if surface.coupled else -1)
    return replace(first, kd=kd, kt_d=kt_d, coupled=coupled > 0, glosses=tuple(glosses))


def _shared(found: Sequence[Texture | None], what: str, said: list[str]) -> Texture | None:
    """The texture of all lobes."""
    textures = [t for t in found if t is not None]
    if not textures:
        return None
    if any(t is None or not _same(t, textures[0]) for t in found):
        said.append(f"the {what} of its lobes vary in different ways: all follow the first that does")
    return textures[0]


def _rgb(texture: Texture | None) -> Texture | None:
    if texture is None or texture.texels.shape[-1] == 3:
        return texture
    return replace(texture, texels=np.repeat(texture.texels, 3, axis=-1))


def _same(a: Texture, b: Texture) -> bool:
    if a.uv_transform != b.uv_transform or a.texels.shape != b.texels.shape:
        return False
    return a.texels is b.texels or bool(np.array_equal(a.texels, b.texels))


def rgb(values: Floats) -> Triple:
    """(r, g, b) of three numbers, or of one for all."""
    return triple(np.broadcast_to(values, 3))
