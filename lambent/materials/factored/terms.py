"""The editable representation: a BRDF as a sum of products of curves (Ben-Artzi 2007, eq. 3.1).

    f(wi, wo) = sum over terms of  f_q rho_q(wi, wo) f_o(theta_o) f_A(gamma_A(wi, wo)) f_B(gamma_B(wi, wo))

f_q is a colour, rho_q the quotient, which edits do not change, and each f is a curve. Terms may share curves.

Roughness may vary over a surface: one highlight curve serves every point, stretched with the local slopes. If slopes
are r times as wide, the distribution at an angle is the original at the angle whose tangent is r times smaller, divided
by r^2 (Heitz 2014, section 5.3). Beckmann's and GGX are shape-invariant, so this is exact for both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.plain import Triple
from lambent.materials.bsdf import components
from lambent.materials.document import Kind
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.parametrisations import PARAMETRISATIONS, angle_of
from lambent.materials.factored.quotients import DIFFUSE
from lambent.materials.lobes import NUMPY, Vector, half_vector

SLOPES = ("theta_h", "slope_t", "slope_b")  # angles whose tangent is a slope of the half vector


def varies(term: Term) -> bool:
    """Whether a texture of roughness changes a term."""
    return any(factor.over in SLOPES for factor in term.factors)


def narrowed(over: str, angle_rad: Any, roughness: Any, ops: Any) -> Any:
    """The angle at which to look up a curve over `over` for slopes `roughness` times those of the curve."""
    if over not in SLOPES:
        return angle_rad
    return ops.atan2(ops.sin(angle_rad), ops.cos(angle_rad) * roughness)


def thinned(term: Term, wi: Vector, wo: Vector, roughness: Any, ops: Any) -> Any:
    """Factor on the quotient of a varying term: (cos_h' / cos_h)^(4 - h) / roughness^2.

    Curves are distributions of normals, that is, of slopes over cos_h^4, except for the 1 / cos_h^h in the quotient.
    """
    x, y, z = half_vector(wi, wo, ops)
    square = roughness * roughness
    narrower = (x * x + y * y) / square + z * z  # (cos_h / cos_h')^2
    return ops.power(narrower, (getattr(term.quotient, "h", 0.0) - 4) / 2) / square


MOST_CURVES = 2  # per term, besides f_o


class Quotient(Protocol):
    """rho_q: a frozen value whose `repr` identifies it, for keys of stores."""

    def evaluate(self, wi: Vector, wo: Vector, ops: Any) -> Any:
        """rho_q (...) in 1/sr, or RGB as a tuple of three; wi and wo are on the upper side."""


@dataclass(frozen=True)
class Factor:
    """One curve in a term: the curve's name, and the angle it runs over (a key of `PARAMETRISATIONS`)."""

    curve: str
    over: str
    stretch: float = 1.0

    @property
    def polar(self) -> int:
        """`polar` of `Curve.band_means`."""
        return PARAMETRISATIONS[self.over].polar


@dataclass(frozen=True)
class Term:
    """One product. `scale` is f_q; `factors` are f_A and f_B; `viewer` is f_o, over theta_o.

    Before evaluation, wi of a transmission term is mirrored at the surface, and wi of a retro term about n.
    """

    name: str
    quotient: Quotient
    scale: Triple = (1.0, 1.0, 1.0)
    factors: tuple[Factor, ...] = ()
    viewer: str | None = None  # name of the curve f_o
    side: Kind = "reflection"

    def __post_init__(self) -> None:
        assert len(self.factors) <= MOST_CURVES, "a term has one curve or two besides that of the viewer"

    @property
    def curves(self) -> tuple[str, ...]:
        """Names of its curves, without repeats."""
        names = [factor.curve for factor in self.factors] + ([self.viewer] if self.viewer else [])
        return tuple(dict.fromkeys(names))

    @property
    def is_diffuse(self) -> bool:
        """Whether the texture of the diffuse colour multiplies the term, rather than that of highlights.

        A curve over any angle but theta_i and theta_o describes a highlight or a Fresnel factor. A term without
        `factors` has the shape of its quotient: diffuse for one of `quotients.DIFFUSE`, so that a constant is
        Lambertian; any other quotient is an uneditable highlight.
        """
        if not self.factors:
            return isinstance(self.quotient, DIFFUSE)
        return all(factor.over in ("theta_i", "theta_o") for factor in self.factors)

    @property
    def fixed(self) -> str:
        """The inputs of transport in words; edits of curves and colours leave them unchanged."""
        return repr((self.quotient, self.factors, self.side))


@dataclass(frozen=True)
class Editable:
    """A material as terms and their curves.

    `fixed` names the parts that the curves cannot change, such as a masking term; they stay as when the terms were
    made.
    """

    name: str
    terms: tuple[Term, ...]
    curves: Mapping[str, Curve]
    fixed: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        used = {name for term in self.terms for name in term.curves}
        assert used == set(self.curves), f"curves {sorted(used ^ set(self.curves))} are unused or missing"

    @property
    def sides(self) -> list[str]:
        """The sides it scatters to: reflection, transmission or both."""
        return sorted({"transmission" if term.side == "transmission" else "reflection" for term in self.terms})

    def with_curve(self, name: str, curve: Curve) -> Editable:
        return replace(self, curves={**self.curves, name: curve})

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., 3) in 1/sr without the cosine, for directions (..., 3); a two-sided sheet."""
        return np.asarray(sum((self.eval_term(term, wi, wo) for term in self.terms), np.zeros((*wi.shape[:-1], 3))))

    def eval_term(self, term: Term, wi: Floats, wo: Floats) -> Floats:
        """f (..., 3) of one term."""
        pair, seen = upper_pair(components(wi), components(wo), term.side, NUMPY)
        value = np.asarray(term.scale) * _rgb(term.quotient.evaluate(*pair, NUMPY))
        for factor in term.factors:
            value = value * self.curves[factor.curve].at(angle_of(factor.over, *pair, factor.stretch))
        if term.viewer:
            value = value * self.curves[term.viewer].at(angle_of("theta_o", *pair))
        return np.where(seen[..., None], value, 0.0)


def upper_pair(wi: Vector, wo: Vector, side: Kind, ops: Any) -> tuple[tuple[Vector, Vector], Any]:
    """wi as a term of this side uses it, wo on the upper side, and whether the term scatters between them."""
    seen = wi[2] * wo[2] < 0 if side == "transmission" else wi[2] * wo[2] > 0
    x, y = (-wi[0], -wi[1]) if side == "retro" else wi[:2]
    return ((x, y, ops.abs(wi[2])), (wo[0], wo[1], ops.abs(wo[2]))), seen


def _rgb(value: Any) -> Floats:
    if isinstance(value, tuple):
        return np.stack(np.broadcast_arrays(*value), axis=-1)
    return np.asarray(value)[..., None]
