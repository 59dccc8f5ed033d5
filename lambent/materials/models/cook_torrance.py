"""Cook and Torrance's microfacets: Beckmann's distribution, V-shaped grooves, and Fresnel's equations of a metal.

The factor is microfacet theory's 1/4 (Walter et al. 2007, eq. 20); the original's 1/pi loses light.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from lambent.materials.fresnel import conductor
from lambent.materials.models.model import Floats, Model, Pair, Parameter, beckmann, reflected, sample_beckmann, upper


class CookTorrance(Model):
    """F D G / (4 (wi.n)(wo.n))."""

    name = "cook-torrance"
    title = "Cook-Torrance (Beckmann, n and k)"
    source = (
        "Cook and Torrance 1982, A reflectance model for computer graphics; G: Torrance and Sparrow 1967; "
        "factor 1/4: Walter et al. 2007, eq. 20"
    )
    parameters = (
        Parameter("m", 0.003, 1.0, 0.2, "roughness", unit="slope", scale="log"),
        Parameter("n", 0.05, 10.0, 3.1, "real part of the index of refraction", scale="log", rgb=True),
        Parameter("k", 0.0, 15.0, 3.3, "absorption, imaginary part of the index", rgb=True),
    )
    white: ClassVar = {"m": 0.2, "n": 0.05, "k": 15.0}
    known_deficiencies: ClassVar = {
        "lossless": "light that bounces twice between facets is lost, and every metal absorbs some"
    }

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        pair, m = upper(wi, wo), self.number("m")
        value = beckmann(pair.h, m, m) * _grooves(pair) / (4 * pair.cos_i * pair.cos_o)
        fresnel = conductor(np.minimum(pair.cos_d, 1.0)[..., None], self.rgb("n"), self.rgb("k"))
        return np.asarray(np.where(pair.seen, value, 0.0)[..., None] * fresnel)

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        pair, m = upper(wi, wo), self.number("m")
        return np.asarray(np.where(pair.seen, beckmann(pair.h, m, m) * pair.cos_h / (4 * pair.cos_d), 0.0))

    def sample(self, wo: Floats, u: Floats) -> Floats:
        m = self.number("m")
        return reflected(wo, sample_beckmann(u[..., 1], u[..., 2], m, m))


def _grooves(pair: Pair) -> Floats:
    """Shadowing and masking of V-shaped grooves (Torrance and Sparrow)."""
    return np.asarray(np.minimum(1.0, 2 * pair.cos_h * np.minimum(pair.cos_i, pair.cos_o) / pair.cos_d))
