"""How much light the surface of a dielectric reflects, smooth or rough: what lies under a coat loses that.

Rough ones as Mitsuba has them: one bounce on microfacets, Smith's masking (Walter et al. 2007, "Microfacet models for
refraction", eqs 19-28, 34); light that would bounce twice is lost.
"""

from __future__ import annotations

import numpy as np

from lambent.core.frames import Floats

COSINES, FACETS = 32, 48  # Gauss-Legendre points over cos theta_i; quadrature over facets, each way


def fresnel(cos_i: Floats, eta: float) -> Floats:
    """Reflectance of unpolarised light at a dielectric; eta, inside by outside, may be below 1 (total reflection)."""
    sin2_t = (1 - cos_i**2) / eta**2
    cos_t = np.sqrt(np.maximum(1 - sin2_t, 0))
    parallel = (eta * cos_i - cos_t) / np.maximum(eta * cos_i + cos_t, 1e-12)
    across = (cos_i - eta * cos_t) / np.maximum(cos_i + eta * cos_t, 1e-12)
    return np.where(sin2_t >= 1, 1.0, (parallel**2 + across**2) / 2)


def reflectance(cos_i: Floats, eta: float, m: float = 0.0, distribution: str = "ggx") -> Floats:
    """Share of light from one direction that is reflected, at each of cos_i (N,); m is the slope roughness."""
    if m == 0:
        return fresnel(cos_i, eta)
    u = (np.arange(FACETS) + 0.5) / FACETS
    r = np.sqrt(u / (1 - u)) if distribution == "ggx" else np.sqrt(-np.log(1 - u))
    x = (m * r[:, None] * np.cos(2 * np.pi * u)).ravel()
    z = np.repeat(1 / np.sqrt(1 + (m * r) ** 2), FACETS)  # of facets drawn with density D cos
    ci = cos_i[:, None]
    cos_d = np.maximum((np.sqrt(1 - ci**2) * x + ci) * z, 0)
    cos_o = 2 * cos_d * z - ci
    held = fresnel(cos_d, eta) * _unmasked(ci, m, distribution) * _unmasked(np.maximum(cos_o, 1e-6), m, distribution)
    return np.where(cos_o > 0, held * cos_d / (ci * z), 0.0).mean(axis=1)


def mean_reflectance(eta: float, m: float = 0.0, distribution: str = "ggx") -> float:
    """Share of diffuse light that is reflected."""
    points, weights = np.polynomial.legendre.leggauss(COSINES)
    cos_i = (points + 1) / 2
    return float(np.sum(weights * cos_i * reflectance(cos_i, eta, m, distribution)))


def _unmasked(cosine: Floats, m: float, distribution: str) -> Floats:
    """Smith's share of facets that are seen."""
    tangent = np.sqrt(np.maximum(1 - cosine**2, 0)) / cosine
    if distribution == "ggx":
        return np.asarray(2 / (1 + np.sqrt(1 + (m * tangent) ** 2)))
    a = 1 / np.maximum(m * tangent, 1e-6)
    fitted = (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2)
    return np.where(a < 1.6, fitted, 1.0)
