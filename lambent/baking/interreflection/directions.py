"""First-bounce directions for BRDFs not yet known: a broad and a narrow lobe (Ben-Artzi 2007, 6.1.1).

Seven in ten are cosine distributed; the others follow a Blinn lobe about the mirror direction. For a term that
transmits or retro-reflects, both lobes are on its own side.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.materials.factored.terms import Editable

NARROW, EXPONENT = 0.3, 200.0  # share and exponent of the Blinn lobe


@dataclass
class Sides:
    """Shares of each point's directions that pass through the surface, and that return to the viewer."""

    through: Any
    back: Any


def shares_of(editable: Editable) -> np.ndarray:
    """(2,) shares of first directions that pass through the surface, and that return to the viewer."""
    sides = {term.side for term in editable.terms}
    if sides == {"transmission"}:
        return np.array([1.0, 0.0])
    return np.array([0.5 * ("transmission" in sides), 0.25 * ("retro" in sides)])


def sampled(wo: Any, sides: Sides, u_side: Any, u_lobe: Any, u: Any) -> tuple[Any, Any]:
    """A direction in the local frame of wo (above), and its density in 1/sr; density 0 marks one to ignore."""
    upper = _upper(wo, u_lobe, u)
    through = u_side < sides.through
    back = ~through & (u_side < sides.through + sides.back)
    wi = dr.select(back, mi.Vector3f(-upper.x, -upper.y, upper.z), upper)
    wi = dr.select(through, mi.Vector3f(upper.x, upper.y, -upper.z), wi)
    return wi, dr.select(upper.z > 1e-6, density(wi, wo, sides), 0.0)


def density(wi: Any, wo: Any, sides: Sides) -> Any:
    """Density of `sampled` at wi, in 1/sr."""
    below = wi.z < 0
    upper = mi.Vector3f(wi.x, wi.y, dr.abs(wi.z))
    turned = mi.Vector3f(-wi.x, -wi.y, wi.z)
    above = (1 - sides.through - sides.back) * _density(upper, wo)
    above += dr.select(sides.back > 0, sides.back * _density(turned, wo), 0.0)
    return dr.select(below, sides.through * _density(upper, wo), above)


def _upper(wo: Any, u_lobe: Any, u: Any) -> Any:
    broad = mi.warp.square_to_cosine_hemisphere(u)
    cos_h = dr.power(1 - u.x, 1 / (EXPONENT + 1))
    sin_h = dr.sqrt(dr.maximum(1 - cos_h * cos_h, 0.0))
    sine, cosine = dr.sincos(2 * dr.pi * u.y)
    h = mi.Vector3f(sin_h * cosine, sin_h * sine, cos_h)
    narrow = 2 * dr.dot(wo, h) * h - wo
    return dr.select(u_lobe < NARROW, narrow, broad)


def _density(wi: Any, wo: Any) -> Any:
    h = dr.normalize(wi + wo)
    d = dr.abs(dr.dot(wo, h))
    blinn = (EXPONENT + 1) / (2 * dr.pi) * dr.power(dr.maximum(h.z, 0.0), EXPONENT) / dr.maximum(4 * d, 1e-6)
    return (1 - NARROW) * wi.z / dr.pi + NARROW * blinn
