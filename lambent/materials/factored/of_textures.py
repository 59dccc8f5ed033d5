"""Homomorphic factors as curves (Ben-Artzi 2007, eq. 3.16): P(theta_i) Q(theta_h) P(theta_o).

The curves are the textures' means over azimuth; the rest of each texture stays in the quotient.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.plain import triple
from lambent.materials.factored.curve import END_RAD, KNOTS, Curve, angles_rad
from lambent.materials.factored.parametrisations import angle_of
from lambent.materials.factored.tabulated import MOST, digest_of
from lambent.materials.factored.terms import Editable, Factor, Term
from lambent.materials.lobes import NUMPY, Vector, half_vector
from lambent.materials.measured.homomorphic import HomomorphicTable, ParabolicMap, radial_means


@dataclass(frozen=True)
class Azimuths:
    """p(wi) q(h) p(wo), RGB: the textures over their means at the same angle, each clamped to [0, MOST].

    Ratios are formed at look-up, not per texel: means bend more than bilinear ratios can follow.
    """

    p: ParabolicMap = field(repr=False, compare=False)
    q: ParabolicMap = field(repr=False, compare=False)
    means: tuple[Floats, Floats] = field(repr=False, compare=False)  # of p and q, as the curves' values, flat
    digest: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "digest", digest_of(self.p.texels, self.q.texels, *self.means))

    def evaluate(self, wi: Vector, wo: Vector, ops: Any = NUMPY) -> Vector:
        h = half_vector(wi, wo, ops)
        looked_up = ((self.p, 0, "theta_i", wi), (self.q, 1, "theta_h", h), (self.p, 0, "theta_o", wo))
        value: list[Any] = [1.0, 1.0, 1.0]
        for texture, which, angle, w in looked_up:
            texel, mean = texture.at(w, ops), _at(self.means[which], angle_of(angle, wi, wo, ops=ops), ops)
            for c in range(3):
                ratio = ops.minimum(texel[c] / ops.maximum(mean[c], 1e-12), MOST)
                value[c] = value[c] * ops.select(mean[c] > 0, ratio, 1.0)
        return value[0], value[1], value[2]


def of_textures(table: HomomorphicTable) -> Editable:
    """One term with the curves `P`, over theta_i and theta_o, and `Q`, over theta_h."""
    curves = {name: Curve(radial_means(texture, angles_rad())) for name, texture in (("P", table.p), ("Q", table.q))}
    flat = [np.ascontiguousarray(curves[name].values, np.float32).ravel() for name in ("P", "Q")]
    factors = (Factor("P", "theta_i"), Factor("Q", "theta_h"))
    quotient = Azimuths(table.p, table.q, (flat[0], flat[1]))
    term = Term("factors", quotient, triple(table.alpha), factors, viewer="P")
    return Editable(table.info.file, (term,), curves, ("azimuths",))


def _at(curve: Floats, angle_rad: Any, ops: Any) -> Vector:
    """RGB of a curve's flat values at angles up to END_RAD."""
    place = ops.minimum(angle_rad * (KNOTS / END_RAD), float(KNOTS))
    low = ops.minimum(ops.floor(place), KNOTS - 1.0)
    first, share = 3 * ops.whole(low), place - low
    red, green, blue = (
        ops.gather(curve, first + c) * (1 - share) + ops.gather(curve, first + 3 + c) * share for c in range(3)
    )
    return red, green, blue
