"""The Kurt lobe as models: reflection (Beckmann or GGX) and transmission. The maths is in lobes.py."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from lambent.core.plain import triple
from lambent.materials import lobes
from lambent.materials.bsdf import components
from lambent.materials.document import LEAST_ALPHA, Distribution, Lobe, Side
from lambent.materials.models.model import Floats, Model, Parameter


class Kurt(Model):
    """F D / (4 (wo.h) ((wi.n)(wo.n))^alpha)."""

    name = "kurt"
    title = "Kurt et al."
    source = "Kurt, Szirmay-Kalos, Krivanek 2010, An anisotropic BRDF model for fitting and Monte Carlo rendering"
    parameters = (
        Parameter("k", 0.0, 4.0, 1.0, "coefficient of the lobe", rgb=True),
        Parameter("mx", 0.003, 1.5, 0.2, "roughness along the brushing direction t", unit="slope", scale="log"),
        Parameter("my", 0.003, 1.5, 0.2, "roughness across the brushing direction", unit="slope", scale="log"),
        Parameter("r0", 0.0, 1.0, 0.5, "Fresnel reflectance at normal incidence", rgb=True),
        Parameter("alpha", 0.0, 1.0, 0.0, "exponent of the cosine product: increase at grazing angles"),
    )
    white: ClassVar = {"k": 1.0, "r0": 1.0, "alpha": 0.5}
    known_deficiencies: ClassVar = {
        "passive": "alpha > 0 and k > 1 return more than arrives near grazing; materials.check reports it",
        "lossless": "no masking term returns the part of the lobe below the horizon",
    }
    side: ClassVar[Side] = "reflection"
    retro: ClassVar[bool] = False
    distribution: ClassVar[Distribution] = "beckmann"

    @property
    def lobe(self) -> Lobe:
        """The lobe with these values, in the form of a material document."""
        mx, my, alpha = (self.number(name) for name in ("mx", "my", "alpha"))
        k, r0 = (triple(self.rgb(name)) for name in ("k", "r0"))
        return Lobe(
            side=self.side, distribution=self.distribution, k=k, r0=r0, mx=mx, my=my, alpha=alpha, retro=self.retro
        )

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        return np.stack(lobes.evaluate(components(wi), components(wo), self.lobe), axis=-1)

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        return np.asarray(lobes.pdf(components(wi), components(wo), self.lobe))

    def sample(self, wo: Floats, u: Floats) -> Floats:
        return np.stack(lobes.sample(components(wo), u[..., 1], u[..., 2], self.lobe), axis=-1)


class KurtGgx(Kurt):
    """The lobe with the long-tailed GGX distribution."""

    name = "kurt-ggx"
    title = "Kurt et al. with GGX tails"
    source = f"{Kurt.source}; Walter et al. 2007, eq. 33"
    distribution = "ggx"


class KurtTransmission(Kurt):
    """The lobe on the far side of a thin sheet, with the factor 1 - F."""

    name = "kurt-transmission"
    title = "Kurt et al., transmission"
    white: ClassVar = {"k": 1.0, "r0": 0.0, "alpha": 0.5}
    side = "transmission"


class KurtRetro(Kurt):
    """The lobe about the direction to the light, with the light mirrored about the normal."""

    name = "kurt-retro"
    title = "Kurt et al., retro-reflection"
    source = (
        f"{Kurt.source}; Belcour, Pacanowski, Delahaie, Laville-Geay, Eupherte 2014, Bidirectional reflectance "
        "distribution function measurements and analysis of retroreflective materials"
    )
    parameters = (
        *Kurt.parameters[:-1],
        Parameter(
            "alpha", LEAST_ALPHA, 1.0, 0.0, "exponent of the cosine product: below 0 the lobe falls at grazing angles"
        ),
    )
    retro = True
