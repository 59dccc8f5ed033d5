"""Blinn's variant of Phong's lobe, over the half vector."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from lambent.materials.models.model import Floats, Model, Parameter, reflected, upper


class BlinnPhong(Model):
    """ks (e + 2)(e + 4) / (8 pi (2^(-e/2) + e)) (n.h)^e."""

    name = "blinn-phong"
    title = "Blinn-Phong"
    source = (
        "Blinn 1977, Models of light reflection for computer synthesized pictures; normalised to reflect ks at normal "
        "incidence: Giesen 2009, Phong and Blinn-Phong normalization factors"
    )
    parameters = (
        Parameter("ks", 0.0, 1.0, 0.5, "share of the light that is reflected at normal incidence", rgb=True),
        Parameter("exponent", 1.0, 10_000.0, 50.0, "how narrow the lobe is", scale="log"),
    )
    white: ClassVar = {"ks": 1.0}
    known_deficiencies: ClassVar = {"lossless": "darkens towards grazing: the lobe is not divided by the cosines"}

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        pair, e = upper(wi, wo), self.number("exponent")
        scale = (e + 2) * (e + 4) / (8 * np.pi * (2 ** (-e / 2) + e))
        return np.asarray(np.where(pair.seen, scale * pair.cos_h**e, 0.0)[..., None] * self.rgb("ks"))

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        pair, e = upper(wi, wo), self.number("exponent")
        return np.asarray(np.where(pair.seen, (e + 1) / (2 * np.pi) * pair.cos_h**e / (4 * pair.cos_d), 0.0))

    def sample(self, wo: Floats, u: Floats) -> Floats:
        z, phi = (1 - u[..., 1]) ** (1 / (self.number("exponent") + 1)), 2 * np.pi * u[..., 2]
        r = np.sqrt((1 - z) * (1 + z))
        return reflected(wo, np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1))
