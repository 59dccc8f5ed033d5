"""Roughness that varies over a surface: one curve of a highlight serves every point, stretched as its slopes are.

A distribution of slopes that is r times as wide has, at an angle, the value of the first at the angle whose tangent is
r times smaller, over r^2 (Heitz 2014, section 5.3: Beckmann's and GGX are shape-invariant). For those it is exact.
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
    """The angle at which a curve over `over` is looked up where slopes are `roughness` times those of the curve."""
    if over not in SLOPES:
        return angle_rad
    return ops.atan2(ops.sin(angle_rad), ops.cos(angle_rad) * roughness)


def thinned(term: Term, wi: Vector, wo: Vector, roughness: Any, ops: Any) -> Any:
    """What the quotient of a varying term is multiplied by: (cos_h' / cos_h)^(4 - h) / roughness^2.

    Curves are distributions of normals, slopes over cos_h^4, but for the 1 / cos_h^h that the quotient has of them.
    """
    x, y, z = half_vector(wi, wo, ops)
    square = roughness * roughness
    narrower = (x * x + y * y) / square + z * z  # (cos_h / cos_h')^2
    return ops.power(narrower, (getattr(term.quotient, "h", 0.0) - 4) / 2) / square
