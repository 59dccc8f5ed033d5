"""Ashikhmin and Shirley's anisotropic Phong lobe with its coupled diffuse term.

Hazard: 1 - (h.n)^2 in the exponent cancels near the normal; it is computed from h.x^2 + h.y^2.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from lambent.materials.fresnel import schlick
from lambent.materials.models.model import Floats, Model, Pair, Parameter, reflected, sample_cosine, upper

DIFFUSE_SHARE = 0.5  # of the samples


class AshikhminShirley(Model):
    """Lobe F sqrt((ex+1)(ey+1)) (n.h)^e / (8 pi (wo.h) max(wi.n, wo.n)) plus 28 rd (1-rs) / (23 pi) (...)(...)."""

    name = "ashikhmin-shirley"
    title = "Ashikhmin-Shirley"
    source = "Ashikhmin and Shirley 2000, An anisotropic Phong BRDF model, eqs 4 to 10"
    parameters = (
        Parameter("rd", 0.0, 1.0, 0.3, "reflectance of the diffuse base under the lobe", rgb=True),
        Parameter("rs", 0.0, 1.0, 0.05, "reflectance of the lobe at normal incidence", rgb=True),
        Parameter("ex", 1.0, 10_000.0, 100.0, "exponent along the brushing direction t", scale="log"),
        Parameter("ey", 1.0, 10_000.0, 100.0, "exponent across the brushing direction", scale="log"),
    )
    white: ClassVar = {"rd": 1.0, "rs": 1.0}
    known_deficiencies: ClassVar = {"lossless": "max(wi.n, wo.n) stands for the masking, whose loss is not returned"}

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        pair, rd, rs = upper(wi, wo), self.rgb("rd"), self.rgb("rs")
        lobe = self._of_h(pair) / (4 * pair.cos_d * np.maximum(pair.cos_i, pair.cos_o))
        below = (1 - (1 - pair.cos_i / 2) ** 5) * (1 - (1 - pair.cos_o / 2) ** 5) * 28 / (23 * np.pi)
        f = lobe[..., None] * schlick(pair.cos_d, rs) + below[..., None] * rd * (1 - rs)
        return np.asarray(np.where(pair.seen[..., None], f, 0.0))

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        pair, share = upper(wi, wo), self._diffuse_share()
        value = share * pair.cos_i / np.pi + (1 - share) * self._of_h(pair) / (4 * pair.cos_d)
        return np.asarray(np.where(pair.seen, value, 0.0))

    def sample(self, wo: Floats, u: Floats) -> Floats:
        ex, ey = self.number("ex"), self.number("ey")
        x, y = np.sqrt(ey + 1) * np.cos(2 * np.pi * u[..., 2]), np.sqrt(ex + 1) * np.sin(2 * np.pi * u[..., 2])
        length2 = x * x + y * y
        exponent = (ex * x * x + ey * y * y) / length2
        z = (1 - u[..., 1]) ** (1 / (exponent + 1))
        r = np.sqrt((1 - z) * (1 + z) / length2)
        wi = reflected(wo, np.stack([r * x, r * y, z], axis=-1))
        return np.where(u[..., :1] < self._diffuse_share(), sample_cosine(wo, u[..., 1:]), wi)

    def _of_h(self, pair: Pair) -> Floats:
        """Density of the half vector in 1/sr."""
        ex, ey = self.number("ex"), self.number("ey")
        x2, y2 = pair.h[..., 0] ** 2, pair.h[..., 1] ** 2
        exponent = (ex * x2 + ey * y2) / np.maximum(x2 + y2, 1e-30)
        return np.asarray(np.sqrt((ex + 1) * (ey + 1)) / (2 * np.pi) * pair.cos_h**exponent)

    def _diffuse_share(self) -> float:
        return DIFFUSE_SHARE if np.any(self.rgb("rd") * (1 - self.rgb("rs")) > 0) else 0.0
