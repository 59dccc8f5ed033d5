"""Lobes and material documents as terms and curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.plain import triple
from lambent.materials.bsdf import under_fresnel
from lambent.materials.document import COEFFICIENT_MAX, Lobe, Material
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.quotients import CoupledDiffuse, Microfacets, One
from lambent.materials.factored.terms import Editable, Factor, Term
from lambent.materials.lobes import NUMPY, density_of_slopes, passed
from lambent.materials.slope_curve import NODES_COSINE, NODES_RHO, ROW, at_cosine, normalised, slope_table

STEEPEST_RAD = 1.57  # beyond, the squared tangent overflows the curve's range
ONE = Curve.constant()
SAME = 1e-3  # relative difference up to which channels share a curve


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


def of_curve(lobe: Lobe, name: str = "highlight") -> Highlight:
    """A curve lobe: one curve over theta_h, stretched to circles if anisotropic."""
    m, stretched = float(np.sqrt(lobe.mx * lobe.my)), lobe.mx != lobe.my

    def density(x: Floats) -> Floats:
        value = density_of_slopes((np.tan(np.minimum(x, STEEPEST_RAD)) / m) ** 2, lobe) / (np.pi * m * m)
        return np.asarray(value / (1 if stretched else _cos4(x)))

    factor = Factor(name, "theta_h", stretch=float(np.sqrt(lobe.my / lobe.mx)))
    return Highlight((factor,), {name: Curve.of(density)}, 4.0 if stretched else 0.0)


def as_curve_lobe(lobe: Lobe, curves: Mapping[str, Curve], scale: Floats, prefix: str = "") -> Lobe | None:
    """The curve lobe that has edited `curves` of a lobe's terms, times a colour (3,); None if no curve lobe has.

    One curve over theta_h serves all channels: None if their highlights are no multiples of each other, and for a
    Beckmann lobe of two slopes, which has two curves.
    """
    highlight, fresnel = curves.get(f"{prefix}highlight"), curves.get(f"{prefix}fresnel")
    if highlight is None or fresnel is None:
        return None
    m, stretched = float(np.sqrt(lobe.mx * lobe.my)), lobe.mx != lobe.my
    theta = np.arctan(NODES_RHO * m)
    density = highlight.at(theta) * (np.pi * m * m) * (1 if stretched else np.cos(theta)[:, None] ** 4)
    size = density.max(axis=0)
    if not (density >= 0).all() or size.max() <= 0:
        return None
    shape = density[:, int(np.argmax(size))] / size.max()
    if np.abs(density - size * shape[:, None]).max() > SAME * size.max():
        return None
    mass = np.exp(-slope_table(tuple(shape.tolist()))[::ROW].max())  # twice the integral of the shape over rho drho
    tint = fresnel.at(np.arccos(NODES_COSINE)) * (size * mass * np.asarray(scale))
    k = tint.max(axis=0)
    share = np.divide(tint, k, out=np.zeros_like(tint), where=k > 0)
    if (tint < 0).any() or not (k <= COEFFICIENT_MAX).all():
        return None
    red, green, blue = (1 - share if lobe.side == "transmission" else share).T.tolist()
    update = {"distribution": "curve", "shape": tuple(shape.tolist()), "fresnel": (red, green, blue), "k": triple(k)}
    return Lobe.model_validate(lobe.model_dump() | update)


def as_kd_curve(curve: Curve, coupled: bool) -> tuple[tuple[float, ...], Floats] | None:
    """Nodes of the `kd_curve` that an edited curve of the diffuse term is, and the factor (3,) of kd; or None.

    The factors t of a coupled term become part of the curve. One curve serves all channels: None if they are no
    multiples of each other.
    """
    nodes = curve.at(np.arccos(NODES_COSINE))
    if coupled:
        nodes = nodes * np.sqrt(21 / 20) * under_fresnel(NODES_COSINE)[:, None]
    size = nodes.max(axis=0)
    shape = nodes[:, int(np.argmax(size))] / max(size.max(), 1e-30)
    if (nodes < 0).any() or size.max() <= 0 or np.abs(nodes - size * shape[:, None]).max() > SAME * size.max():
        return None
    one = tuple(shape.tolist())
    return one, (size * shape.max() / max(normalised(one))) ** 2


@lru_cache(maxsize=128)  # an edit of one lobe keeps the curves of the others
def lobe_terms(lobe: Lobe, prefix: str = "") -> tuple[tuple[Term, ...], dict[str, Curve]]:
    """Terms and curves of a Kurt lobe; names begin with `prefix`.

    If the highlight takes both curves, none is left for Fresnel: two terms then share them and blend by Schlick's
    factor.
    """
    name = f"{prefix}highlight"
    if lobe.shape is not None:
        highlight = of_curve(lobe, name)
    else:
        highlight = (ggx if lobe.distribution == "ggx" else beckmann)(lobe.mx, lobe.my, name)
    k, r0 = np.array(lobe.k), np.array(lobe.r0)
    across = lobe.side == "transmission"

    def term(name: str, scale: Floats, factors: tuple[Factor, ...], *, grazing: bool = False) -> Term:
        quotient = Microfacets(1.0, lobe.alpha, highlight.cos_h, grazing)
        return Term(f"{prefix}{name}", quotient, triple(scale), factors, side=lobe.kind)

    if len(highlight.factors) == 2:
        sign = -1 if across else 1
        normal = term("specular", k * (1 - r0 if across else r0), highlight.factors)
        return (normal, term("grazing", sign * k * (1 - r0), highlight.factors, grazing=True)), highlight.curves
    fresnel = Curve.of(lambda x: np.stack([passed(np.maximum(np.cos(x), 0), lobe, c) for c in range(3)], axis=-1))
    factors = (*highlight.factors, Factor(f"{prefix}fresnel", "theta_d"))
    return (term("specular", k, factors),), {**highlight.curves, f"{prefix}fresnel": fresnel}


def of_material(material: Material) -> Editable:
    """The terms and curves of a material document: one term per diffuse part, one or two per lobe."""
    terms: list[Term] = []
    curves: dict[str, Curve] = {}
    if any(material.kd):
        quotient, scale = (CoupledDiffuse(), 1.0) if material.kd_coupled else (One(), 1 / np.pi)
        bent = material.kd_curve
        curves["diffuse"] = ONE if bent is None else _over_cosine(normalised(bent))
        scale_r = triple(scale * np.array(material.kd))
        terms.append(Term("diffuse", quotient, scale_r, (Factor("diffuse", "theta_i"),), viewer="diffuse"))
    if any(material.kt_d):
        scale_t = triple(np.array(material.kt_d) / np.pi)
        factor = Factor("diffuse through", "theta_i")
        terms.append(Term("diffuse through", One(), scale_t, (factor,), side="transmission"))
        curves["diffuse through"] = ONE
    for prefix, lobe in prefixed(material.lobes):
        more, of_lobe = lobe_terms(lobe, prefix)
        terms += more
        curves |= of_lobe
    return Editable(material.name, tuple(terms), curves)


@lru_cache(maxsize=16)
def _over_cosine(nodes: tuple[float, ...]) -> Curve:
    return Curve.of(lambda x: at_cosine(np.cos(x), nodes, NUMPY))


def prefixed(lobes: Sequence[Lobe]) -> list[tuple[str, Lobe]]:
    """The lobes of a document with the prefixes of their terms and curves; empty for a single lobe."""
    return [(f"lobe {number} " if len(lobes) > 1 else "", lobe) for number, lobe in enumerate(lobes, start=1)]


def _cos4(x: Floats) -> Floats:
    return np.asarray(np.maximum(np.cos(x), 1e-6) ** 4)
