"""The editable representation: a BRDF as a sum of products of curves (Ben-Artzi 2007, eq. 3.1).

    f(wi, wo) = sum over terms of  f_q rho_q(wi, wo) f_o(theta_o) f_A(gamma_A(wi, wo)) f_B(gamma_B(wi, wo))

f_q is a colour, rho_q the quotient, which edits leave as it is, and the f are curves. Terms may share curves.
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
from lambent.materials.lobes import NUMPY, Vector

MOST_CURVES = 2  # besides f_o that one term may have


class Quotient(Protocol):
    """rho_q: a frozen value whose `repr` says all about it, for keys of stores."""

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
        """As `Curve.band_means` takes it."""
        return PARAMETRISATIONS[self.over].polar


@dataclass(frozen=True)
class Term:
    """One product. `scale` is f_q; `factors` are f_A and f_B; `viewer` is f_o, over theta_o.

    Before anything is evaluated, wi of a transmission term is mirrored at the surface, that of a retro term about n.
    """

    name: str
    quotient: Quotient
    scale: Triple = (1.0, 1.0, 1.0)
    factors: tuple[Factor, ...] = ()
    viewer: str | None = None  # name of its curve
    side: Kind = "reflection"

    def __post_init__(self) -> None:
        assert len(self.factors) <= MOST_CURVES, "a term has one curve or two besides that of the viewer"

    @property
    def curves(self) -> tuple[str, ...]:
        """Names of its curves, each once."""
        names = [factor.curve for factor in self.factors] + ([self.viewer] if self.viewer else [])
        return tuple(dict.fromkeys(names))

    @property
    def is_diffuse(self) -> bool:
        """Whether the texture of the diffuse colour multiplies it, not that of highlights.

        Curves over angles other than theta_i and theta_o know a highlight or Fresnel's factor. A term without `factors`
        has the shape of its quotient: light from below the surface for one of `quotients.DIFFUSE`, so that a constant
        is Lambertian; any other quotient is a highlight that cannot be edited.
        """
        if not self.factors:
            return isinstance(self.quotient, DIFFUSE)
        return all(factor.over in ("theta_i", "theta_o") for factor in self.factors)

    @property
    def fixed(self) -> str:
        """All of it that transport depends on, in words: edits of curves and colours leave it as it is."""
        return repr((self.quotient, self.factors, self.side))


@dataclass(frozen=True)
class Editable:
    """A material as terms and their curves.

    `fixed` names what the curves cannot change, and stays as it was when the terms were made: a masking term, say.
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
        """Those that it scatters to: reflection, transmission or both."""
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
    """wi, as a term of this side sees it, and wo on the upper side; and whether it scatters between them."""
    seen = wi[2] * wo[2] < 0 if side == "transmission" else wi[2] * wo[2] > 0
    x, y = (-wi[0], -wi[1]) if side == "retro" else wi[:2]
    return ((x, y, ops.abs(wi[2])), (wo[0], wo[1], ops.abs(wo[2]))), seen


def _rgb(value: Any) -> Floats:
    if isinstance(value, tuple):
        return np.stack(np.broadcast_arrays(*value), axis=-1)
    return np.asarray(value)[..., None]
