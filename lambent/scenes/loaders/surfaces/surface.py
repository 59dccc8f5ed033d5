"""Surfaces as files describe them, from which materials and textures are created."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lambent.core.geometry.directions import Floats
from lambent.core.plain import Triple, triple
from lambent.materials.document import Distribution, Side
from lambent.scenes.loaders.surfaces.textured import Textured, combined, constant, scaled
from lambent.scenes.scene import Texture

ROUGHNESS_MIN = 0.003  # slope; below, single precision loses the lobe
BLACK = np.zeros(3)
# Albedo at 85 degrees of a dielectric's lobe with r0 = .04, by slope.
AT_GRAZING = (0.25, 0.36, 0.49, 0.64, 1.0), (0.24, 0.18, 0.14, 0.1, 0.06)
GREY = 0.5  # of surfaces without a description
UNDESCRIBED = "is not defined: it becomes grey"


@dataclass(frozen=True)
class SpecularLobe:
    """One lobe of slope roughness `m` along t and `m` times `aspect` across, coefficient `k` and reflectance `r0` (3,).

    `masked`: the format multiplies it by Smith's masking. Its albedo has another factor cos_o^falloff.
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

    @staticmethod
    def grey() -> Surface:
        """A surface without a description."""
        return Surface(kd=constant(np.full(3, GREY)))

    def with_opacity(self, opacity: Floats) -> Surface:
        """A surface that covers a share (3,) of the background; the rest of the light passes undeviated."""
        held = constant(opacity)

        def part(v: Textured) -> Textured:
            return combined(lambda a, b: a * b, v, held, notes=[])

        lobes = (*(replace(lobe, k=part(lobe.k)) for lobe in self.lobes), unscattered(1 - opacity))
        return replace(self, kd=part(self.kd), kt_d=part(self.kt_d), lobes=lobes)

    def coated(self, coat: SpecularLobe) -> Surface:
        """A surface below a clear coat, which removes the light that it reflects: more at grazing incidence.

        1 - k F is nearly (1 - k r0) cos^(k/4) up to 80 degrees: lobes get that factor, the diffuse term is coupled.
        """
        share = float(np.clip(coat.k.mean.mean(), 0, 1))
        left = 1 - share * float(np.mean(coat.r0))
        under = (replace(o, k=scaled(o.k, left), falloff=o.falloff + share / 4) for o in self.lobes)
        coupled = self.coupled or share > 0.5
        return replace(self, kd=scaled(self.kd, left), coupled=coupled, lobes=(*under, coat))


def unscattered(k: Floats) -> SpecularLobe:
    """The narrowest lobe of transmission, which passes a share k (3,) of the light undeviated.

    Such a lobe falls off as 1 - (1 - cos)^5 for any r0; the exponent compensates for that up to 60 degrees.
    """
    return SpecularLobe(constant(ROUGHNESS_MIN), constant(k), BLACK, side="transmission", masked=False, falloff=-0.04)


def blended(parts: Sequence[tuple[Surface, float]], notes: list[str]) -> Surface:
    """Weighted sum of surfaces; normal map and mask are those of the first."""
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


def metallic_roughness(
    base: Textured,
    metallic: Textured,
    alpha: Textured,
    plain: Floats,
    notes: list[str],
    *,
    weight: float = 1.0,
    aspect: float = 1.0,
    through: float = 0.0,
    by_half_vector: bool = False,
) -> Surface:
    """Surface of a base colour: metals reflect it without a diffuse term, dielectrics have it below a clear coat.

    Parameters
    ----------
    base : Textured
        Base colour, 3 channels.
    metallic, alpha : Textured
        Share of metal, and GGX's roughness along t as a slope (roughness squared); 1 channel.
    plain : (3,)
        Reflectance of a dielectric at normal incidence.
    weight : float
        Factor of the dielectric's reflection, at grazing incidence too.
    aspect : float
        Roughness across t divided by that along t.
    through : float
        Share of the dielectric's light that is transmitted, as by a thin sheet.
    by_half_vector : bool
        Whether the format's diffuse term is multiplied by 1 - F at the half vector, as glTF's.

    Notes
    -----
    Partial metals are blends (glTF 2.0, appendix B). The diffuse term is coupled to Fresnel. At the half vector F
    hardly rises towards grazing: where that is the format's, the diffuse term of rough dielectrics is not coupled, as
    long as no more light returns than arrives. At roughness 1 and 88 degrees a base colour of .5 keeps .47 of the light
    by glTF, and coupled .08: grounds would darken towards the horizon. Where the reflectance varies,
    r0 is the highest and the lobe's coefficient varies: exact at normal incidence and never above 1, but places of low
    reflectance lack Fresnel's rise at grazing incidence.
    """
    plain = np.clip(plain, 0, 1)
    left = 1 - weight * float(plain.max())
    kd = combined(lambda b, m: b * (1 - m) * (1 - through) * left, base, metallic, notes=notes)
    reflectance = combined(lambda b, m: (1 - m) * weight * plain + m * b, base, metallic, notes=notes)
    highest = np.maximum(reflectance.highest, 1e-6)
    if reflectance.is_texture and float((reflectance.highest - reflectance.values.min(axis=(0, 1))).max()) > 1e-3:
        share = np.asarray(reflectance.values / highest.astype(np.float32), np.float32)
        k, r0 = Textured(share, reflectance.uv_transform), highest
        if metallic.is_texture:
            notes.append("its metallic texture is exact at normal incidence only: metal parts lack the Fresnel rise")
    else:
        grazing = weight + (1 - weight) * float(np.clip(metallic.mean[0], 0, 1))
        k, r0 = constant(np.full(3, grazing)), reflectance.mean / max(grazing, 1e-6)
    lobes = [SpecularLobe(alpha, k, r0, aspect)]
    if through > 0:
        passed = combined(lambda b, m: through * b * (1 - m), base, metallic, notes=notes)
        lobes.append(SpecularLobe(alpha, passed, weight * plain, aspect, side="transmission"))
    coupled = weight > 0.5 and plain.max() > 0
    slope = float(alpha.mean[0])
    if by_half_vector and slope >= AT_GRAZING[0][0]:
        coupled &= bool(kd.highest.max() + np.interp(slope, *AT_GRAZING) > 1)
    return Surface(kd=kd, coupled=bool(coupled), lobes=tuple(lobes))


def rgb(values: Floats) -> Triple:
    """(r, g, b) of three numbers, or of one for all."""
    return triple(np.broadcast_to(values, 3))
