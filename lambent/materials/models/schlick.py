"""Schlick's inexpensive model: rational functions in place of exponentials.

This is the glossy term B with its self-obstruction G. The full model adds a Lambertian share for r > 1/2 and a mirror
for r < 1/2, which a mixture can add; its term (1 - G G') / (4 pi v v') for obstructed light grows without bound towards
grazing and is left out.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from lambent.core.geometry.directions import normalize
from lambent.materials.fresnel import schlick
from lambent.materials.models.model import Floats, Model, Pair, Parameter, reflected, upper


class Schlick(Model):
    """S(u) G(v) G(v') Z(t) A(w) / (4 pi v v'), with v = wo.n, v' = wi.n, t = h.n, u = wo.h, w along the brushing."""

    name = "schlick"
    title = "Schlick"
    source = "Schlick 1994, An inexpensive BRDF model for physically-based rendering, section 4"
    parameters = (
        Parameter("c", 0.0, 1.0, 0.5, "reflectance at normal incidence", rgb=True),
        Parameter(
            "r", 1e-5, 1.0, 0.04, "roughness, 0 a mirror to 1 a matt surface; the square of a slope", scale="log"
        ),
        Parameter("p", 0.05, 1.0, 1.0, "isotropy, 0 brushed along t to 1 isotropic"),
    )
    white: ClassVar = {"c": 1.0}
    known_deficiencies: ClassVar = {
        "lossless": "obstructed light is not returned, and A(w) has a mean below 1 for p < 1",
        "passive": "G obstructs less than facets of that roughness would: 1.8 times the light returns at 89 degrees",
    }

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        pair, r = upper(wi, wo), self.number("r")
        obstruction = 1 / ((r + (1 - r) * pair.cos_i) * (r + (1 - r) * pair.cos_o))  # G G' / (v v')
        value = self._zenith(pair) * self._azimuth(pair) * obstruction / (4 * np.pi)
        return np.asarray(np.where(pair.seen, value, 0.0)[..., None] * schlick(pair.cos_d, self.rgb("c")))

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        pair, p = upper(wi, wo), self.number("p")
        y = np.arctan2(np.abs(pair.h[..., 0]), np.abs(pair.h[..., 1])) * (2 / np.pi)
        of_phi = p * p / (p * p + (1 - p * p) * y * y) ** 1.5 / (2 * np.pi)
        return np.asarray(np.where(pair.seen, self._zenith(pair) * 2 * pair.cos_h * of_phi / (4 * pair.cos_d), 0.0))

    def sample(self, wo: Floats, u: Floats) -> Floats:
        r, p = self.number("r"), self.number("p")
        tangent = np.sqrt(r * u[..., 1] / (1 - np.minimum(u[..., 1], 1 - 1e-12)))
        quarter, b = np.modf(4 * u[..., 2])[::-1]
        y = p * b / np.sqrt(1 - (1 - p * p) * b * b)
        x_sign, y_sign = np.where(quarter % 2 < 1, 1.0, -1.0), np.where(quarter < 2, 1.0, -1.0)
        x, along = x_sign * np.sin(np.pi / 2 * y), y_sign * np.cos(np.pi / 2 * y)
        return reflected(wo, normalize(np.stack([tangent * x, tangent * along, np.ones_like(tangent)], axis=-1)))

    def _zenith(self, pair: Pair) -> Floats:
        """Z(t) = r / (1 + r t^2 - t^2)^2; 1 - t^2 from the components, because it cancels."""
        r = self.number("r")
        sin2 = pair.h[..., 0] ** 2 + pair.h[..., 1] ** 2
        return np.asarray(r / (sin2 + r * pair.cos_h**2) ** 2)

    def _azimuth(self, pair: Pair) -> Floats:
        """A(w) = sqrt(p / (p^2 - p^2 w^2 + w^2)), w the cosine between t and the projection of h."""
        p = self.number("p")
        x2, y2 = pair.h[..., 0] ** 2, pair.h[..., 1] ** 2
        w2 = np.divide(x2, x2 + y2, out=np.zeros_like(x2), where=x2 + y2 > 1e-30)
        return np.asarray(np.sqrt(p / (p * p + (1 - p * p) * w2)))
