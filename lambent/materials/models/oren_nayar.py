"""Oren and Nayar's rough diffuse surface, the full model with one interreflection."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from lambent.core.geometry.directions import elevation
from lambent.materials.models.model import Floats, Model, Parameter, cosine_pdf, sample_cosine, upper


class OrenNayar(Model):
    """V-shaped Lambertian grooves; their slope angles are normally distributed with standard deviation sigma."""

    name = "oren-nayar"
    title = "Oren-Nayar (full)"
    source = "Oren and Nayar 1994, Generalization of Lambert's reflectance model, eqs 27 to 29"
    parameters = (
        Parameter("rho", 0.0, 1.0, 0.5, "albedo of the facets", rgb=True),
        Parameter("sigma", 0.0, 90.0, 20.0, "standard deviation of the facets' angle", unit="degrees"),
    )
    white: ClassVar = {"rho": 1.0}
    known_deficiencies: ClassVar = {
        "lossless": "only one interreflection is counted",
        "passive": "the functions fitted to the integral exceed it: by up to 4 % at grazing, for rho = 1",
    }

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        pair, sigma2 = upper(wi, wo), np.radians(self.number("sigma")) ** 2
        theta_i, theta_o = elevation(pair.wi), elevation(pair.wo)
        alpha, beta = np.maximum(theta_i, theta_o), np.minimum(theta_i, theta_o)
        across = pair.wi[..., 0] * pair.wo[..., 0] + pair.wi[..., 1] * pair.wo[..., 1]
        size = np.sin(theta_i) * np.sin(theta_o)
        cos_phi = np.clip(np.divide(across, size, out=np.zeros_like(size), where=size > 1e-12), -1.0, 1.0)

        c1 = 1 - 0.5 * sigma2 / (sigma2 + 0.33)
        c2 = 0.45 * sigma2 / (sigma2 + 0.09) * (np.sin(alpha) - np.where(cos_phi < 0, (2 * beta / np.pi) ** 3, 0.0))
        c3 = 0.125 * sigma2 / (sigma2 + 0.09) * (4 * alpha * beta / np.pi**2) ** 2
        direct = c1 + cos_phi * c2 * np.tan(beta) + (1 - np.abs(cos_phi)) * c3 * np.tan((alpha + beta) / 2)
        twice = 0.17 * sigma2 / (sigma2 + 0.13) * (1 - cos_phi * (2 * beta / np.pi) ** 2)
        rho = self.rgb("rho")
        f = np.maximum(direct[..., None] * rho + twice[..., None] * rho**2, 0.0) / np.pi
        return np.asarray(np.where(pair.seen[..., None], f, 0.0))

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        return cosine_pdf(wi, wo)

    def sample(self, wo: Floats, u: Floats) -> Floats:
        return sample_cosine(wo, u[..., 1:])
