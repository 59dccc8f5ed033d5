"""Evaluation of terms and curves on the device: f of an edited material."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from lambent.materials.factored.curve import END_RAD, KNOTS
from lambent.materials.factored.parametrisations import angle_of
from lambent.materials.factored.terms import Editable, Term, upper_pair


class Curves:
    """A material with its curves as tables on the device."""

    def __init__(self, material: Editable, ops: Any) -> None:
        self.material, self._ops = material, ops
        self._tables = {name: [mi.Float(c) for c in curve.values.T] for name, curve in material.curves.items()}

    def evaluate(self, wi: Any, wo: Any, diffuse: Any, specular: Any) -> Any:
        """f (mi.Vector3f) in 1/sr without the cosine; textures multiply terms by `diffuse` and `specular`."""
        total = mi.Vector3f(0.0)
        for term in self.material.terms:
            (light, viewer), seen = upper_pair(tuple(wi), tuple(wo), term.side, self._ops)
            value = quotient_of(term, light, viewer, self._ops) * mi.Vector3f(*term.scale)
            value *= mi.Vector3f(diffuse if term.is_diffuse else specular)
            for factor in term.factors:
                value *= self._at(factor.curve, angle_of(factor.over, light, viewer, factor.stretch, self._ops))
            if term.viewer:
                value *= self._at(term.viewer, angle_of("theta_o", light, viewer, 1.0, self._ops))
            total += dr.select(seen, value, 0.0)
        return total

    def _at(self, curve: str, angle_rad: Any) -> Any:
        at = dr.clip(angle_rad * (KNOTS / END_RAD), 0, KNOTS)
        k = dr.minimum(mi.UInt32(at), KNOTS - 1)
        share = at - mi.Float(k)
        values = (
            dr.gather(mi.Float, c, k) * (1 - share) + dr.gather(mi.Float, c, k + 1) * share for c in self._tables[curve]
        )
        return mi.Vector3f(*values)


def quotient_of(term: Term, light: Any, viewer: Any, ops: Any) -> Any:
    """rho_q (mi.Vector3f) of directions on the upper side."""
    value = term.quotient.evaluate(light, viewer, ops)
    return mi.Vector3f(*value) if isinstance(value, tuple) else mi.Vector3f(value)
