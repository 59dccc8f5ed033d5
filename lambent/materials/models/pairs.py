"""Shared by the models: pairs of directions mirrored to the upper side, Beckmann's distribution, and samplers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Flags
from lambent.core.geometry.directions import half_vector, normalize, raised, reflect
from lambent.core.geometry.sequences import cosine_hemisphere
from lambent.materials.models.model import Floats

LOWEST_COSINE = 1e-9  # keeps 1/cos finite


@dataclass(frozen=True)
class Pair:
    """wi and wo on the upper side with their half vector.

    Attributes
    ----------
    wi, wo, h : (..., 3)
        Unit; z of wi and wo at least LOWEST_COSINE.
    cos_i, cos_o, cos_h, cos_d : (...)
        wi.n, wo.n, h.n, and wo.h.
    seen : (...) bool
        Whether both directions are on one side of the surface.
    """

    wi: Floats
    wo: Floats
    h: Floats
    cos_i: Floats
    cos_o: Floats
    cos_h: Floats
    cos_d: Floats
    seen: Flags


def upper(wi: Floats, wo: Floats) -> Pair:
    """The pair (..., 3) seen from above; a two-sided surface scatters identically from below."""
    seen = np.asarray(wi[..., 2] * wo[..., 2] > 0)
    up_i, up_o = np.broadcast_arrays(raised(wi), raised(wo))
    up_i, up_o = (np.maximum(w, (-np.inf, -np.inf, LOWEST_COSINE)) for w in (up_i, up_o))
    h = half_vector(up_i, up_o)
    cos_d = np.maximum(np.sum(up_o * h, axis=-1), LOWEST_COSINE)
    return Pair(up_i, up_o, h, up_i[..., 2], up_o[..., 2], h[..., 2], cos_d, seen)


def beckmann(h: Floats, mx: float, my: float) -> Floats:
    """Beckmann's distribution of the normals h (..., 3) with slopes mx, my, in 1/sr.

    tan^2(theta_h) is computed from the components of h, which avoids cancellation.
    """
    slope2 = ((h[..., 0] / mx) ** 2 + (h[..., 1] / my) ** 2) / np.maximum(h[..., 2] ** 2, 1e-12)
    return np.asarray(np.exp(-slope2) / (np.pi * mx * my * np.maximum(h[..., 2] ** 4, 1e-24)))


def sample_beckmann(u1: Floats, u2: Floats, mx: float, my: float) -> Floats:
    """h (..., 3) with density beckmann(h) h.z from u1, u2 uniform in [0, 1) (Ward 1992, eqs 6, 7, in slopes)."""
    r, phi = np.sqrt(-np.log1p(-np.minimum(u1, 1 - 1e-12))), 2 * np.pi * u2
    return normalize(np.stack([mx * r * np.cos(phi), my * r * np.sin(phi), np.ones_like(r)], axis=-1))


def reflected(wo: Floats, h: Floats) -> Floats:
    """wi = wo mirrored about h (..., 3), which is on the upper side; wi.z = 0 if that falls below the surface."""
    wi = reflect(raised(wo), h)
    wi[..., 2] = np.maximum(wi[..., 2], 0.0) * np.where(wo[..., 2] > 0, 1.0, -1.0)
    return wi


def sample_cosine(wo: Floats, u: Floats) -> Floats:
    """wi (..., 3) of a diffuse surface, on the side of wo, from u (..., 2) uniform in [0, 1)."""
    wi = cosine_hemisphere(u)
    wi[..., 2] *= np.where(wo[..., 2] > 0, 1.0, -1.0)
    return wi


def cosine_pdf(wi: Floats, wo: Floats) -> Floats:
    """Density (...) of `sample_cosine` in 1/sr."""
    return np.asarray(np.where(wi[..., 2] * wo[..., 2] > 0, np.abs(wi[..., 2]) / np.pi, 0.0))
