"""Phong's lobe about the mirror direction, reciprocal and normalised."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from lambent.core.geometry.directions import HALF_TURN, basis
from lambent.materials.models.model import Floats, Model, Parameter


class Phong(Model):
    """ks (e + 2) / (2 pi) cos^e of the angle between wi and the mirrored wo."""

    name = "phong"
    title = "Phong (modified)"
    source = "Lafortune and Willems 1994, Using the modified Phong reflectance model for physically based rendering"
    parameters = (
        Parameter("ks", 0.0, 1.0, 0.5, "coefficient of the lobe", rgb=True),
        Parameter("exponent", 1.0, 1000.0, 20.0, "how narrow the lobe is", scale="log"),
    )
    white: ClassVar = {"ks": 1.0}
    known_deficiencies: ClassVar = {"lossless": "the part of the lobe below the horizon is lost"}

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        e = self.number("exponent")
        value = (e + 2) / (2 * np.pi) * self._cosine(wi, wo) ** e
        return np.asarray(value[..., None] * self.rgb("ks"))

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        e = self.number("exponent")
        return np.asarray((e + 1) / (2 * np.pi) * self._cosine(wi, wo) ** e)

    def sample(self, wo: Floats, u: Floats) -> Floats:
        axis = wo * HALF_TURN
        t, b = basis(axis)
        z, phi = u[..., 1:2] ** (1 / (self.number("exponent") + 1)), 2 * np.pi * u[..., 2:]
        r = np.sqrt(1 - z * z)
        wi: Floats = r * np.cos(phi) * t + r * np.sin(phi) * b + z * axis
        wi[..., 2] *= wi[..., 2] * wo[..., 2] > 0
        return wi

    @staticmethod
    def _cosine(wi: Floats, wo: Floats) -> Floats:
        """Cosine of the angle between wi and the mirrored wo; 0 outside the lobe."""
        same = wi[..., 2] * wo[..., 2] > 0
        return np.asarray(np.where(same, np.maximum(np.sum(wi * wo * HALF_TURN, axis=-1), 0.0), 0.0))
