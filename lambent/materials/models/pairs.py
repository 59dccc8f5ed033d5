"""What the models of one-sided lobes share: pairs of directions turned to the upper side, and reflected samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.core.directions import normalize
from lambent.materials.models.model import Floats

LOWEST_COSINE = 1e-9  # keeps 1/cos finite; a pair this low is not worth more


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
        Whether both were on one side of the surface.
    """

    wi: Floats
    wo: Floats
    h: Floats
    cos_i: Floats
    cos_o: Floats
    cos_h: Floats
    cos_d: Floats
    seen: NDArray[np.bool_]


def upper(wi: Floats, wo: Floats) -> Pair:
    """The pair (..., 3) as seen from above: a two-sided surface scatters alike from below."""
    seen = np.asarray(wi[..., 2] * wo[..., 2] > 0)
    up_i, up_o = (np.stack([w[..., 0], w[..., 1], np.maximum(np.abs(w[..., 2]), LOWEST_COSINE)], -1) for w in (wi, wo))
    up_i, up_o = np.broadcast_arrays(up_i, up_o)
    h = normalize(up_i + up_o)
    cos_d = np.maximum(np.sum(up_o * h, axis=-1), LOWEST_COSINE)
    return Pair(up_i, up_o, h, up_i[..., 2], up_o[..., 2], h[..., 2], cos_d, seen)


def tangent2(h: Floats, mx: float, my: float) -> Floats:
    """tan^2(theta_h) (cos^2(phi_h)/mx^2 + sin^2(phi_h)/my^2) of h (..., 3), from its components: nothing cancels."""
    h_z2 = np.maximum(h[..., 2] ** 2, 1e-12)
    return np.asarray(((h[..., 0] / mx) ** 2 + (h[..., 1] / my) ** 2) / h_z2)


def beckmann(h: Floats, mx: float, my: float) -> Floats:
    """Beckmann's distribution of the normals h (..., 3) with slopes mx, my, in 1/sr."""
    h_z4 = np.maximum(h[..., 2] ** 4, 1e-24)
    return np.asarray(np.exp(-tangent2(h, mx, my)) / (np.pi * mx * my * h_z4))


def sample_beckmann(u1: Floats, u2: Floats, mx: float, my: float) -> Floats:
    """h (..., 3) with density beckmann(h) h.z from u1, u2 uniform in [0, 1) (Ward 1992, eqs 6, 7, in slopes)."""
    r, phi = np.sqrt(-np.log1p(-np.minimum(u1, 1 - 1e-12))), 2 * np.pi * u2
    return normalize(np.stack([mx * r * np.cos(phi), my * r * np.sin(phi), np.ones_like(r)], axis=-1))


def reflected(wo: Floats, h: Floats) -> Floats:
    """wi = wo mirrored about h (..., 3), which is on the upper side; wi.z = 0 where that ends below the surface."""
    up = np.stack([wo[..., 0], wo[..., 1], np.abs(wo[..., 2])], axis=-1)
    wi = 2 * np.sum(up * h, axis=-1, keepdims=True) * h - up
    wi[..., 2] = np.maximum(wi[..., 2], 0.0) * np.where(wo[..., 2] > 0, 1.0, -1.0)
    return np.asarray(wi)


def schlick(cos_d: Floats, r0: Floats) -> Floats:
    """Schlick's Fresnel reflectance (..., 3) of cos_d (...) and r0 (3,)."""
    return np.asarray(r0 + (1 - r0) * np.maximum(1 - cos_d, 0.0)[..., None] ** 5)
