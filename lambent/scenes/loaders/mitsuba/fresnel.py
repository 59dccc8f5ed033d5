"""Reflectance and transmittance of smooth and rough dielectrics and metals, and their nearest fits by lobes.

Rough surfaces are Mitsuba's: one bounce on microfacets with Smith's masking (Walter et al. 2007, "Microfacet models for
refraction", eqs 19-28, 34). Light of a second bounce is lost, so that reflectance and transmittance do not sum to 1.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from lambent.core.geometry.directions import Floats

COSINES, FACETS = 128, 48  # Gauss-Legendre points over cos theta_i; quadrature over facets, each way
GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(COSINES)
COS = (GAUSS_POINTS + 1) / 2  # where Fresnel's terms are compared


def fresnel(cos_i: Floats, eta: float | complex) -> Floats:
    """Fresnel reflectance of unpolarised light at the relative index eta (eta - ik of metals), inside by outside."""
    inside = np.conj(complex(eta)) if abs(eta) > 1e-3 else 1e-3 + 0j
    cos_t = np.sqrt(1 - (1 - cos_i**2) / inside**2 + 0j)
    across = (cos_i - inside * cos_t) / (cos_i + inside * cos_t)
    parallel = (inside * cos_i - cos_t) / (inside * cos_i + cos_t)
    return np.asarray((np.abs(across) ** 2 + np.abs(parallel) ** 2) / 2)


def reflectance(cos_i: Floats, eta: float, m: float = 0.0, distribution: str = "ggx") -> Floats:
    """Share of the light from one direction that is reflected, at cos_i (N,); m is the slope roughness."""
    if m == 0:
        return fresnel(cos_i, eta)
    ci, z, cos_d = _facets(cos_i, m, distribution)
    return _returned(fresnel(cos_d, eta), 2 * cos_d * z - ci, ci, z, cos_d, m, distribution)


def transmittance(cos_i: Floats, eta: float, m: float = 0.0, distribution: str = "ggx") -> Floats:
    """Share of the light from one direction that is transmitted, at cos_i (N,)."""
    if m == 0:
        return 1 - fresnel(cos_i, eta)
    ci, z, cos_d = _facets(cos_i, m, distribution)
    cos_t = np.sqrt(np.maximum(1 - (1 - cos_d**2) / eta**2, 0))
    cos_o = ci / eta - (cos_d / eta - cos_t) * z  # on the far side
    return _returned(1 - fresnel(cos_d, eta), cos_o, ci, z, cos_d, m, distribution)


@cache
def mean_reflectance(eta: float, m: float = 0.0, distribution: str = "ggx") -> float:
    """Share of diffuse light that is reflected."""
    if m == 0 and eta < 1:  # inside a smooth surface: by reciprocity from outside
        return 1 - (1 - mean_reflectance(1 / eta)) * eta**2
    return _mean(reflectance(COS, eta, m, distribution))


@cache
def mean_transmittance(eta: float, m: float = 0.0, distribution: str = "ggx") -> float:
    """Share of diffuse light that is transmitted."""
    return _mean(transmittance(COS, eta, m, distribution))


def nearest_fresnel(exact: Floats) -> tuple[float, float]:
    """r0 and k <= 1 for which k (r0 + (1 - r0)(1 - cos)^5) is nearest to a reflectance at `COS`.

    The error is relative and weighted by the cosine. Metals, whose reflectance dips before it rises, become nearly
    flat; a dielectric gets slightly more at normal incidence, to compensate for Schlick's deficit at 60 degrees.
    """
    rise = (1 - COS) ** 5
    weight = GAUSS_WEIGHTS * COS / np.maximum(exact, 1e-3)
    basis = np.stack([np.ones_like(COS), rise]) * np.sqrt(weight)
    a, b = np.linalg.lstsq(basis.T, exact * np.sqrt(weight), rcond=None)[0]
    if b < 0:
        a, b = float(np.sum(weight * exact) / np.sum(weight)), 0.0
    elif a + b > 1:
        a = float(np.sum(weight * (exact - rise) * (1 - rise)) / np.sum(weight * (1 - rise) ** 2))
        b = 1 - a
    a = max(float(a), 0.0)
    return a / max(a + float(b), 1e-9), min(a + float(b), 1.0)


def nearest_passage(exact: Floats) -> tuple[float, float]:
    """k and x for which k (1 - (1 - cos)^5) cos^x is nearest to a transmittance at `COS`."""
    under = 1 - (1 - COS) ** 5
    powers = np.linspace(-0.04, 0.5, 55)
    shapes = under * COS ** powers[:, None]
    weight = GAUSS_WEIGHTS * COS
    k = (weight * shapes * exact).sum(axis=1) / (weight * shapes**2).sum(axis=1)
    k = np.minimum(k, exact.max())  # thin glass must not have an albedo above 1
    off = (weight * (k[:, None] * shapes - exact) ** 2).sum(axis=1)
    best = int(np.argmin(off))
    return float(k[best]), float(powers[best])


def _mean(values: Floats) -> float:
    return float(np.sum(GAUSS_WEIGHTS * COS * values))


def _facets(cos_i: Floats, m: float, distribution: str) -> tuple[Floats, Floats, Floats]:
    """cos_i (N, 1), and for facets of density D cos the cosines to the surface's normal and to the light (N, K)."""
    u = (np.arange(FACETS) + 0.5) / FACETS
    r = np.sqrt(u / (1 - u)) if distribution == "ggx" else np.sqrt(-np.log(1 - u))
    x = (m * r[:, None] * np.cos(2 * np.pi * u)).ravel()
    z = np.repeat(1 / np.sqrt(1 + (m * r) ** 2), FACETS)
    ci = cos_i[:, None]
    return ci, z, np.maximum((np.sqrt(1 - ci**2) * x + ci) * z, 0)


def _returned(
    share: Floats, cos_o: Floats, ci: Floats, z: Floats, cos_d: Floats, m: float, distribution: str
) -> Floats:
    """Mean over facets of the light that leaves at cos_o without masking."""
    held = share * _unmasked(ci, m, distribution) * _unmasked(np.maximum(cos_o, 1e-6), m, distribution)
    return np.asarray(np.where(cos_o > 0, held * cos_d / (ci * z), 0.0).mean(axis=1))


def _unmasked(cosine: Floats, m: float, distribution: str) -> Floats:
    """Share of facets that Smith's masking leaves visible."""
    tangent = np.sqrt(np.maximum(1 - cosine**2, 0)) / cosine
    if distribution == "ggx":
        return np.asarray(2 / (1 + np.sqrt(1 + (m * tangent) ** 2)))
    a = 1 / np.maximum(m * tangent, 1e-6)
    fitted = (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2)
    return np.where(a < 1.6, fitted, 1.0)
