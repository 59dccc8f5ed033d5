"""Direction pairs for comparing a material with another tool's model, and the model's microfacet terms.

All these tools use the same microfacets, D G / (4 (wi.n)(wo.n)) over a GGX (or Beckmann) distribution with Smith's
masking; they differ in the form of masking and in the factors.

Sources: Walter et al. 2007, Microfacet models for refraction, eqs 25-28, 33, 34; Heitz 2014, Understanding the
masking-shadowing function, eqs 72, 86, 99 (anisotropic, height-correlated).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.directions import direction, raised
from lambent.materials import lobes
from lambent.materials.bsdf import MaterialBSDF, components
from lambent.materials.document import Distribution, Material
from lambent.materials.fresnel import schlick_weight
from lambent.materials.lobes import Vector
from lambent.materials.measured.protocol import GRAZING_DEG, LeftOut, MeasuredSamples, TableInfo

FIT_LOG2, CHECK_LOG2 = 12, 14  # number of pairs for the fit, and for measuring the errors
Masking = Literal["correlated", "separable"]


@dataclass(frozen=True)
class Pairs:
    """A material's values at pairs of directions, with the terms of all microfacet models.

    Attributes
    ----------
    samples : MeasuredSamples
        wi, wo, f (1 channel for a grey material) and the solid angle of wo.
    wi, wo, h : component tuples of (N,)
        Directions on the upper side (wo mirrored at the surface where it is below), and their half vector.
    cos_d : (N,)
        wo.h.
    """

    samples: MeasuredSamples
    wi: Vector
    wo: Vector
    h: Vector
    cos_d: Floats

    def __len__(self) -> int:
        return len(self.samples)

    @property
    def far(self) -> Flags:
        """(N,) whether wo is on the far side."""
        return self.samples.transmitted

    @cached_property
    def schlick(self) -> Floats:
        """(N,) (1 - wo.h)^5."""
        return schlick_weight(self.cos_d)

    def facets(
        self, mx: float, my: float, masking: Masking = "correlated", distribution: Distribution = "ggx"
    ) -> Floats:
        """(N,) D G / (4 cos_i cos_o) in 1/sr, without Fresnel; uses the mirrored pair if wo is on the far side."""
        hz2 = self.h[2] ** 2
        slope2 = ((self.h[0] / mx) ** 2 + (self.h[1] / my) ** 2) / hz2
        tails = np.exp(-slope2) if distribution == "beckmann" else (1 + slope2) ** -2.0
        d = tails / (np.pi * mx * my * hz2**2)
        return np.asarray(d * self._masking(mx, my, masking, distribution) / (4 * self.wi[2] * self.wo[2]))

    def _masking(self, mx: float, my: float, masking: Masking, distribution: Distribution) -> Floats:
        """(N,) Smith's G in [0, 1]."""
        smith = _beckmann_lambda if distribution == "beckmann" else _ggx_lambda
        one, other = (smith(((mx * w[0]) ** 2 + (my * w[1]) ** 2) / w[2] ** 2) for w in (self.wi, self.wo))
        return np.asarray(1 / (1 + one + other) if masking == "correlated" else 1 / ((1 + one) * (1 + other)))


def _ggx_lambda(slope2: Floats) -> Floats:
    return np.asarray((np.sqrt(1 + slope2) - 1) / 2)


def _beckmann_lambda(slope2: Floats) -> Floats:
    """Walter's rational fit of Beckmann's Lambda, as Mitsuba and pbrt use it; slope2 is (alpha tan theta)^2."""
    a = 1 / np.sqrt(np.maximum(slope2, 1e-12))
    return np.where(a >= 1.6, 0.0, (1 - 1.259 * a + 0.396 * a * a) / (3.535 * a + 2.181 * a * a))


def is_grey(material: Material) -> bool:
    """Whether all coefficients are equal in the three channels."""
    triples = [material.kd, material.kt_d, *(rgb for lobe in material.lobes for rgb in (lobe.k, lobe.r0))]
    return all(len(set(rgb)) == 1 for rgb in triples)


def is_isotropic(material: Material) -> bool:
    return all(lobe.mx == lobe.my for lobe in material.lobes)


def pairs_of(material: Material, log2_count: int, seed: int) -> Pairs:
    """Draw pairs distributed as in a measurement: theta_i uniform up to the grazing limit, wo over both sides.

    Half of the wo are uniform in solid angle, half follow the material's own lobes, so that no peak is missed. A pair's
    weight is the solid angle of wo, as in a measured table.

    Parameters
    ----------
    log2_count : int
        2^log2_count pairs are drawn; those beyond the grazing limit are dropped.
    """
    from scipy.stats import qmc

    u = qmc.Sobol(6, scramble=True, rng=seed).random_base2(log2_count)
    lowest = np.cos(np.radians(GRAZING_DEG))
    phi_i = 0 * u[:, 1] if is_isotropic(material) else 2 * np.pi * u[:, 1]
    wi = direction(np.radians(GRAZING_DEG) * u[:, 0], phi_i)
    sides = 2 if material.transmits else 1
    z = 2 * u[:, 3] - 1 if material.transmits else u[:, 3]
    even = direction(np.arccos(z), 2 * np.pi * u[:, 4])
    bsdf = MaterialBSDF(material)
    wo = np.where((u[:, 2] < 0.5)[:, None], even, bsdf.sample(wi, u[:, 3:6]))
    density = 0.5 / (2 * np.pi * sides) + 0.5 * bsdf.pdf(wo, wi)
    seen = np.abs(wo[:, 2]) > lowest
    wi, wo, weight = wi[seen], wo[seen], 1 / density[seen]
    f = bsdf.eval(wi, wo)[:, : 1 if is_grey(material) else 3]
    info = TableInfo(material.name, "direction pairs", is_isotropic(material), material.transmits, f.shape[1], "f")
    upper_wi, upper_wo = components(wi), components(raised(wo))
    h = lobes.half_vector(upper_wi, upper_wo)
    samples = MeasuredSamples(wi, wo, f, weight, LeftOut(), info)
    return Pairs(samples, upper_wi, upper_wo, h, lobes.dot(upper_wo, h))
