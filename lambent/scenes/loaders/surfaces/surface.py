"""Surfaces as files describe them, before materials and textures are made of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lambent.core.directions import Floats
from lambent.core.plain import Triple, triple
from lambent.materials.document import Distribution, Side
from lambent.scenes.loaders.surfaces.textured import Textured, combined, constant, scaled
from lambent.scenes.scene import Texture

ROUGHNESS_MIN = 0.003  # slope; below, single precision loses the lobe
BLACK = np.zeros(3)


@dataclass(frozen=True)
class SpecularLobe:
    """One lobe of slope roughness `m` along t and `m` times `aspect` across, coefficient `k` and reflectance `r0` (3,).

    `masked` is whether the format multiplies it by Smith's masking. Its albedo has a further factor cos_o^falloff.
    """

    m: Textured
    k: Textured
    r0: Floats
    aspect: float = 1.0
    side: Side = "reflection"
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


def rgb(values: Floats) -> Triple:
    """(r, g, b) of three numbers, or of one for all."""
    return triple(np.broadcast_to(values, 3))
