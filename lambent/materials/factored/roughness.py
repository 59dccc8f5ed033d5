"""Roughness that varies over a surface: one highlight curve serves every point, stretched with the local slopes.

If slopes are r times as wide, the distribution at an angle is the original at the angle whose tangent is r times
smaller, divided by r^2 (Heitz 2014, section 5.3). Beckmann's and GGX are shape-invariant, so this is exact for both.
"""

from __future__ import annotations

from typing import Any

from lambent.materials.factored.terms import Term
from lambent.materials.lobes import Vector, half_vector

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
