"""Lobes and material documents as terms and curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.plain import triple
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.quotients import CoupledDiffuse, Microfacets, One
from lambent.materials.factored.terms import Editable, Factor, Term
from lambent.materials.fresnel import schlick


@dataclass(frozen=True)
class Highlight:
    """A distribution of normals as factors and curves; its part 1 / cos_h^`cos_h` is left to the quotient."""

    factors: tuple[Factor, ...]
    curves: dict[str, Curve]
    cos_h: float


def beckmann(mx: float, my: float, name: str = "highlight") -> Highlight:
    """Beckmann's distribution: one curve over theta_h, or, if anisotropic, two over the slopes."""
    if mx == my:
        curve = Curve.of(lambda x: np.exp(-((np.tan(x) / mx) ** 2)) / (np.pi * mx * mx * _cos4(x)))
        return Highlight((Factor(name, "theta_h"),), {name: curve}, 0.0)
    along = Curve.of(lambda x: np.exp(-((np.tan(x) / mx) ** 2)) / (np.sqrt(np.pi) * mx))
    across = Curve.of(lambda x: np.exp(-((np.tan(x) / my) ** 2)) / (np.sqrt(np.pi) * my))
    names = (f"{name} along", f"{name} across")
    factors = (Factor(names[0], "slope_t"), Factor(names[1], "slope_b"))
    return Highlight(factors, dict(zip(names, (along, across), strict=True)), 4.0)


def ggx(mx: float, my: float, name: str = "highlight") -> Highlight:
    """GGX: one curve over theta_h, stretched to circles if anisotropic."""
    m2, stretched = mx * my, mx != my
    curve = Curve.of(lambda x: 1 / (np.pi * m2 * (1 if stretched else _cos4(x)) * (1 + np.tan(x) ** 2 / m2) ** 2))
    factor = Factor(name, "theta_h", stretch=float(np.sqrt(my / mx)))
    return Highlight((factor,), {name: curve}, 4.0 if stretched else 0.0)


def lobe_terms(lobe: Lobe, prefix: str = "") -> tuple[tuple[Term, ...], dict[str, Curve]]:
    """Terms and curves of a Kurt lobe; names begin with `prefix`.

    If the highlight takes both curves, none is left for Fresnel: two terms then share them and blend by Schlick's
    factor.
    """
    highlight = (ggx if lobe.distribution == "ggx" else beckmann)(lobe.mx, lobe.my, f"{prefix}highlight")
    k, r0 = np.array(lobe.k), np.array(lobe.r0)
    across = lobe.side == "transmission"

    def term(name: str, scale: Floats, factors: tuple[Factor, ...], *, grazing: bool = False) -> Term:
        quotient = Microfacets(1.0, lobe.alpha, highlight.cos_h, grazing)
        return Term(f"{prefix}{name}", quotient, triple(scale), factors, side=lobe.kind)

    if len(highlight.factors) == 2:
        sign = -1 if across else 1
        normal = term("specular", k * (1 - r0 if across else r0), highlight.factors)
        return (normal, term("grazing", sign * k * (1 - r0), highlight.factors, grazing=True)), highlight.curves
    fresnel = Curve.of(lambda x: 1 - schlick(np.cos(x), r0) if across else schlick(np.cos(x), r0))
    factors = (*highlight.factors, Factor(f"{prefix}fresnel", "theta_d"))
    return (term("specular", k, factors),), {**highlight.curves, f"{prefix}fresnel": fresnel}


def of_material(material: Material) -> Editable:
    """The terms and curves of a material document: one term per diffuse part, one or two per lobe."""
    terms: list[Term] = []
    curves: dict[str, Curve] = {}
    if any(material.kd):
        quotient, scale = (CoupledDiffuse(), 1.0) if material.kd_coupled else (One(), 1 / np.pi)
        terms.append(Term("diffuse", quotient, triple(scale * np.array(material.kd)), (Factor("diffuse", "theta_i"),)))
        curves["diffuse"] = Curve.constant()
    if any(material.kt_d):
        scale_t = triple(np.array(material.kt_d) / np.pi)
        factor = Factor("diffuse through", "theta_i")
        terms.append(Term("diffuse through", One(), scale_t, (factor,), side="transmission"))
        curves["diffuse through"] = Curve.constant()
    for prefix, lobe in prefixed(material.lobes):
        more, of_lobe = lobe_terms(lobe, prefix)
        terms += more
        curves |= of_lobe
    return Editable(material.name, tuple(terms), curves)


def prefixed(lobes: Sequence[Lobe]) -> list[tuple[str, Lobe]]:
    """The lobes of a document with the prefixes of their terms and curves; empty for a single lobe."""
    return [(f"lobe {number} " if len(lobes) > 1 else "", lobe) for number, lobe in enumerate(lobes, start=1)]


def _cos4(x: Floats) -> Floats:
    return np.asarray(np.maximum(np.cos(x), 1e-6) ** 4)
