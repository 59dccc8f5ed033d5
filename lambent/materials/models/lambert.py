"""Lambert's diffuse reflection."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from lambent.materials.models.model import Floats, Model, Parameter, cosine_pdf, sample_cosine


class Lambert(Model):
    """f = kd / pi on the side of the viewer."""

    name = "lambert"
    title = "Lambert"
    source = "Lambert 1760, Photometria"
    parameters = (Parameter("kd", 0.0, 1.0, 0.5, "share of the light that is reflected", rgb=True),)
    white: ClassVar = {"kd": 1.0}

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        same = wi[..., 2:] * wo[..., 2:] > 0
        return np.asarray(np.where(same, self.rgb("kd") / np.pi, 0.0))

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        return cosine_pdf(wi, wo)

    def sample(self, wo: Floats, u: Floats) -> Floats:
        return sample_cosine(wo, u[..., 1:])
