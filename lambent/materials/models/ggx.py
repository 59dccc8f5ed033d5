"""GGX as in current engines: height-correlated Smith masking, Schlick's Fresnel, visible-normal sampling.

Hazard: 1 - (n.h)^2 cancels at low roughness; everything is computed from the components of h instead.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from lambent.core.geometry.directions import normalize, raised
from lambent.materials.fresnel import schlick, smith_lambda
from lambent.materials.models.model import Floats, Model, Parameter, reflected, upper


class Ggx(Model):
    """F D G / (4 (wi.n)(wo.n))."""

    name = "ggx"
    title = "GGX (Smith, Schlick)"
    source = (
        "Walter et al. 2007, Microfacet models for refraction, eq. 33; Heitz 2014, Understanding the masking-shadowing "
        "function, eqs 86 and 99; Heitz 2018, Sampling the GGX distribution of visible normals"
    )
    parameters = (
        Parameter("f0", 0.0, 1.0, 0.5, "reflectance at normal incidence", rgb=True),
        Parameter("alpha_x", 0.003, 1.0, 0.2, "roughness along the brushing direction t", unit="slope", scale="log"),
        Parameter("alpha_y", 0.003, 1.0, 0.2, "roughness across the brushing direction", unit="slope", scale="log"),
    )
    white: ClassVar = {"f0": 1.0, "alpha_x": 0.8, "alpha_y": 0.8}
    known_deficiencies: ClassVar = {
        "lossless": "light that bounces twice between facets is lost: a third at roughness 1"
    }

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        pair = upper(wi, wo)
        masking = 1 / (1 + self._lambda(pair.wi) + self._lambda(pair.wo))
        value = np.where(pair.seen, self._distribution(pair.h) * masking / (4 * pair.cos_i * pair.cos_o), 0.0)
        return np.asarray(value[..., None] * schlick(pair.cos_d, self.rgb("f0")))

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        pair = upper(wi, wo)
        value = self._distribution(pair.h) / ((1 + self._lambda(pair.wo)) * 4 * pair.cos_o)
        return np.asarray(np.where(pair.seen, value, 0.0))

    def sample(self, wo: Floats, u: Floats) -> Floats:
        return reflected(wo, self._visible_normal(raised(wo), u[..., 1], u[..., 2]))

    def _distribution(self, h: Floats) -> Floats:
        ax, ay = self.number("alpha_x"), self.number("alpha_y")
        stretched = (h[..., 0] / ax) ** 2 + (h[..., 1] / ay) ** 2 + h[..., 2] ** 2
        return np.asarray(1 / (np.pi * ax * ay * stretched**2))

    def _lambda(self, w: Floats) -> Floats:
        """Smith's Lambda (Heitz 2014, eq. 86)."""
        x, y = w[..., 0] * self.number("alpha_x"), w[..., 1] * self.number("alpha_y")
        return smith_lambda((x * x + y * y) / w[..., 2] ** 2, "ggx")

    def _visible_normal(self, wo: Floats, u1: Floats, u2: Floats) -> Floats:
        """Normal with density G1 D (wo.h) / wo.z for wo on the upper side (Heitz 2018, listing 1)."""
        stretch = np.array([self.number("alpha_x"), self.number("alpha_y"), 1.0])
        v = normalize(wo * stretch)
        length = np.hypot(v[..., 0], v[..., 1])
        flat = length < 1e-12  # the viewer is straight above: any tangent works
        safe = np.where(flat, 1.0, length)
        t1 = np.stack([np.where(flat, 1.0, -v[..., 1] / safe), v[..., 0] / safe * ~flat, 0 * safe], axis=-1)
        t2 = np.cross(v, t1)
        r, phi = np.sqrt(u1), 2 * np.pi * u2
        p1, p2 = r * np.cos(phi), r * np.sin(phi)
        s = (1 + v[..., 2]) / 2
        p2 = (1 - s) * np.sqrt(np.maximum(1 - p1**2, 0.0)) + s * p2
        p3 = np.sqrt(np.maximum(1 - p1**2 - p2**2, 0.0))
        h = p1[..., None] * t1 + p2[..., None] * t2 + p3[..., None] * v
        h = h * stretch
        h[..., 2] = np.maximum(h[..., 2], 1e-12)
        return normalize(h)
