"""Quotients: the parts of a BRDF that edits of its curves do not change.

`evaluate(wi, wo, ops)` takes component tuples of directions on the upper side; see `factored.terms.Quotient`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lambent.materials.bsdf import coupling
from lambent.materials.lobes import COS_MIN, Vector, dot, half_vector

LEAST = 1e-9  # keeps 1/cos finite


@dataclass(frozen=True)
class One:
    """1: the curves are the whole term."""

    def evaluate(self, wi: Vector, wo: Vector, ops: Any) -> Any:
        return 1 + 0 * wi[2]


@dataclass(frozen=True)
class CoupledDiffuse:
    """Diffuse reflection under a Fresnel interface (`bsdf.coupling`), over pi."""

    def evaluate(self, wi: Vector, wo: Vector, ops: Any) -> Any:
        return coupling(wi[2], wo[2], ops) / np.pi


@dataclass(frozen=True)
class Microfacets:
    """1 / (4 cos_d^d (cos_i cos_o)^alpha cos_h^h): the factors of a microfacet lobe, no masking.

    `schlick` multiplies by (1 - cos_d)^5: the second of the two terms that a Fresnel factor makes (3.12).
    """

    d: float = 1.0
    alpha: float = 0.0
    h: float = 0.0
    schlick: bool = False

    def evaluate(self, wi: Vector, wo: Vector, ops: Any) -> Any:
        half = half_vector(wi, wo, ops)
        cos_d = ops.maximum(dot(wo, half), 1e-6)
        value = 1 / (4 * ops.power(cos_d, self.d))
        if self.alpha:
            value = value / ops.power(ops.maximum(wi[2] * wo[2], 1e-12), self.alpha)
        if self.h:
            value = value / ops.power(ops.maximum(half[2], 1e-6), self.h)
        if self.schlick:
            value = value * _fifth_power(cos_d, ops)
        return ops.select((wi[2] > COS_MIN) & (wo[2] > COS_MIN), value, 0.0)


@dataclass(frozen=True)
class Grooves:
    """G / (4 cos_i cos_o) with the masking G of V-shaped grooves (Torrance and Sparrow 1967)."""

    def evaluate(self, wi: Vector, wo: Vector, ops: Any) -> Any:
        half = half_vector(wi, wo, ops)
        cos_i, cos_o = ops.maximum(wi[2], LEAST), ops.maximum(wo[2], LEAST)
        masking = 2 * half[2] * ops.minimum(cos_i, cos_o) / ops.maximum(dot(wo, half), LEAST)
        return ops.minimum(masking, 1.0) / (4 * cos_i * cos_o)


@dataclass(frozen=True)
class AshikhminLobe:
    """1 / (4 cos_d max(cos_i, cos_o)), times (1 - cos_d)^5 for the second of its two terms (3.12)."""

    schlick: bool = False

    def evaluate(self, wi: Vector, wo: Vector, ops: Any) -> Any:
        cos_d = ops.maximum(dot(wo, half_vector(wi, wo, ops)), LEAST)
        value = 1 / (4 * cos_d * ops.maximum(ops.maximum(wi[2], wo[2]), LEAST))
        return value * _fifth_power(cos_d, ops) if self.schlick else value


@dataclass(frozen=True)
class AshikhminDiffuse:
    """28 / (23 pi) (1 - (1 - cos_i / 2)^5) (1 - (1 - cos_o / 2)^5)."""

    def evaluate(self, wi: Vector, wo: Vector, ops: Any) -> Any:
        return 28 / (23 * np.pi) * (1 - _fifth_power(wi[2] / 2, ops)) * (1 - _fifth_power(wo[2] / 2, ops))


@dataclass(frozen=True)
class SmithGgx:
    """G / (4 cos_i cos_o), height-correlated Smith masking of GGX with these slopes (Heitz 2014, eqs 86, 99)."""

    alpha_x: float
    alpha_y: float
    h: float = 0.0  # also 1 / cos_h^h

    def evaluate(self, wi: Vector, wo: Vector, ops: Any) -> Any:
        def hidden(w: Vector) -> Any:
            x, y, z = w[0] * self.alpha_x, w[1] * self.alpha_y, ops.maximum(w[2], LEAST)
            return (ops.sqrt(1 + (x * x + y * y) / (z * z)) - 1) / 2

        value = 1 / ((1 + hidden(wi) + hidden(wo)) * 4 * ops.maximum(wi[2], LEAST) * ops.maximum(wo[2], LEAST))
        return value / ops.power(ops.maximum(half_vector(wi, wo, ops)[2], 1e-6), self.h) if self.h else value


@dataclass(frozen=True)
class SchlickGlossy:
    """A(w) / (4 pi (r + (1 - r) cos_i) (r + (1 - r) cos_o)): obstruction and brushing (Schlick 1994, section 4)."""

    r: float
    p: float

    def evaluate(self, wi: Vector, wo: Vector, ops: Any) -> Any:
        half = half_vector(wi, wo, ops)
        sin2 = half[0] * half[0] + half[1] * half[1]
        w2 = ops.select(sin2 > 0, half[0] * half[0] / ops.maximum(sin2, 1e-30), 0.0)
        brushed = ops.sqrt(self.p / (self.p * self.p + (1 - self.p * self.p) * w2))
        return brushed / (4 * np.pi * (self.r + (1 - self.r) * wi[2]) * (self.r + (1 - self.r) * wo[2]))


@dataclass(frozen=True)
class OrenNayarPart:
    """One of the fixed functions of Oren and Nayar 1994, eqs 27 to 29, over pi: `part` is c2, c3 or twice."""

    part: str

    def evaluate(self, wi: Vector, wo: Vector, ops: Any) -> Any:
        sin_i, sin_o = (ops.sqrt(w[0] * w[0] + w[1] * w[1]) for w in (wi, wo))
        theta_i, theta_o = ops.atan2(sin_i, wi[2]), ops.atan2(sin_o, wo[2])
        alpha, beta = ops.maximum(theta_i, theta_o), ops.minimum(theta_i, theta_o)
        across, size = wi[0] * wo[0] + wi[1] * wo[1], sin_i * sin_o
        cos_phi = ops.select(size > 1e-12, ops.minimum(ops.maximum(across / ops.maximum(size, 1e-12), -1), 1), 0.0)
        flat = 2 * beta / np.pi
        if self.part == "c2":
            value = cos_phi * (ops.sin(alpha) - ops.select(cos_phi < 0, flat * flat * flat, 0.0)) * _tan(beta, ops)
        elif self.part == "c3":
            both = 4 * alpha * beta / np.pi**2
            value = (1 - ops.abs(cos_phi)) * both * both * _tan((alpha + beta) / 2, ops)
        else:
            value = 1 - cos_phi * flat * flat
        return value / np.pi


def _tan(angle: Any, ops: Any) -> Any:
    return ops.sin(angle) / ops.maximum(ops.cos(angle), 1e-9)


def _fifth_power(cosine: Any, ops: Any) -> Any:
    m = ops.maximum(1 - cosine, 0.0)
    m2 = m * m
    return m2 * m2 * m


DIFFUSE = (One, CoupledDiffuse, AshikhminDiffuse, OrenNayarPart)  # quotients of light from below the surface
