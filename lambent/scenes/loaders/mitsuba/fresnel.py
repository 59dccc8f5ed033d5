"""Reflectance and transmittance of smooth and rough dielectrics and metals, and their nearest fits by lobes.

Rough surfaces are Mitsuba's: one bounce on microfacets with Smith's masking (Walter et al. 2007, "Microfacet models for
refraction", eqs 19-28, 34). Light of a second bounce is lost, so that reflectance and transmittance do not sum to 1.

`METALS` has, by Mitsuba's name, the reflectances at normal and at grazing incidence for which Schlick's curve is
nearest to Fresnel's (`nearest_fresnel`), from the spectra of eta and k that Mitsuba ships (after Palik and the SOPRA
data), as linear RGB under D65. Reflectance of metals dips before it rises, so the grazing values are below 1.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from lambent.core.geometry.directions import Floats
from lambent.materials.document import Distribution
from lambent.materials.fresnel import conductor, smith_lambda

COSINES, FACETS = 128, 48  # Gauss-Legendre points over cos theta_i; quadrature over facets, each way
GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(COSINES)
COS = (GAUSS_POINTS + 1) / 2  # where Fresnel's terms are compared


def reflectance(cos_i: Floats, eta: float, m: float = 0.0, distribution: Distribution = "ggx") -> Floats:
    """Share of the light from one direction that is reflected, at cos_i (N,); m is the slope roughness."""
    if m == 0:
        return conductor(cos_i, eta, 0.0)
    ci, z, cos_d = _facets(cos_i, m, distribution)
    return _returned(conductor(cos_d, eta, 0.0), 2 * cos_d * z - ci, ci, z, cos_d, m, distribution)


def transmittance(cos_i: Floats, eta: float, m: float = 0.0, distribution: Distribution = "ggx") -> Floats:
    """Share of the light from one direction that is transmitted, at cos_i (N,)."""
    if m == 0:
        return 1 - conductor(cos_i, eta, 0.0)
    ci, z, cos_d = _facets(cos_i, m, distribution)
    cos_t = np.sqrt(np.maximum(1 - (1 - cos_d**2) / eta**2, 0))
    cos_o = ci / eta - (cos_d / eta - cos_t) * z  # on the far side
    return _returned(1 - conductor(cos_d, eta, 0.0), cos_o, ci, z, cos_d, m, distribution)


@cache
def mean_reflectance(eta: float, m: float = 0.0, distribution: Distribution = "ggx") -> float:
    """Share of diffuse light that is reflected."""
    if m == 0 and eta < 1:  # inside a smooth surface: by reciprocity from outside
        return 1 - (1 - mean_reflectance(1 / eta)) * eta**2
    return _mean(reflectance(COS, eta, m, distribution))


@cache
def mean_transmittance(eta: float, m: float = 0.0, distribution: Distribution = "ggx") -> float:
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


def _facets(cos_i: Floats, m: float, distribution: Distribution) -> tuple[Floats, Floats, Floats]:
    """cos_i (N, 1), and for facets of density D cos the cosines to the surface's normal and to the light (N, K)."""
    u = (np.arange(FACETS) + 0.5) / FACETS
    r = np.sqrt(u / (1 - u)) if distribution == "ggx" else np.sqrt(-np.log(1 - u))
    x = (m * r[:, None] * np.cos(2 * np.pi * u)).ravel()
    z = np.repeat(1 / np.sqrt(1 + (m * r) ** 2), FACETS)
    ci = cos_i[:, None]
    return ci, z, np.maximum((np.sqrt(1 - ci**2) * x + ci) * z, 0)


def _returned(
    share: Floats, cos_o: Floats, ci: Floats, z: Floats, cos_d: Floats, m: float, distribution: Distribution
) -> Floats:
    """Mean over facets of the light that leaves at cos_o without masking."""
    held = share * _unmasked(ci, m, distribution) * _unmasked(np.maximum(cos_o, 1e-6), m, distribution)
    return np.asarray(np.where(cos_o > 0, held * cos_d / (ci * z), 0.0).mean(axis=1))


def _unmasked(cosine: Floats, m: float, distribution: Distribution) -> Floats:
    """Share of facets that Smith's masking leaves visible."""
    return np.asarray(1 / (1 + smith_lambda(m**2 * (1 - cosine**2).clip(0) / cosine**2, distribution)))


# fmt: off
METALS = {
    "a-C": ((0.217, 0.218, 0.207), (0.863, 0.883, 0.925)), "Ag": ((0.97, 0.958, 0.914), (0.97, 0.975, 0.997)),
    "Al": ((0.9, 0.911, 0.917), (0.9, 0.911, 0.917)), "AlAs": ((0.285, 0.262, 0.46), (0.756, 0.689, 0.783)),
    "AlSb": ((0.346, 0.378, 0.466), (0.607, 0.558, 0.473)), "Au": ((0.998, 0.782, 0.35), (0.998, 0.996, 0.981)),
    "Be": ((0.528, 0.527, 0.526), (0.566, 0.578, 0.607)), "Cr": ((0.616, 0.645, 0.693), (0.616, 0.645, 0.694)),
    "CsI": ((0.087, 0.089, 0.094), (1, 1, 1)), "Cu": ((0.951, 0.634, 0.537), (0.967, 0.913, 0.923)),
    "Cu2O": ((0.245, 0.266, 0.274), (0.769, 0.735, 0.742)), "CuO": ((0.225, 0.222, 0.221), (0.815, 0.838, 0.864)),
    "d-C": ((0.178, 0.179, 0.183), (0.884, 0.881, 0.875)), "Hg": ((0.764, 0.766, 0.769), (0.764, 0.766, 0.813)),
    "HgTe": ((0.398, 0.379, 0.381), (0.571, 0.64, 0.693)), "Ir": ((0.684, 0.679, 0.645), (0.684, 0.679, 0.722)),
    "K": ((0.951, 0.943, 0.933), (1, 1, 1)), "Li": ((0.912, 0.887, 0.814), (0.966, 0.994, 1)),
    "MgO": ((0.08, 0.081, 0.083), (1, 1, 1)), "Mo": ((0.546, 0.565, 0.559), (0.546, 0.565, 0.595)),
    "Na": ((0.976, 0.961, 0.939), (0.994, 1, 1)), "Nb": ((0.495, 0.498, 0.496), (0.647, 0.633, 0.67)),
    "Ni": ((0.648, 0.599, 0.521), (0.691, 0.752, 0.829)), "Rh": ((0.779, 0.749, 0.729), (0.779, 0.749, 0.729)),
    "Se": ((0.314, 0.271, 0.276), (0.671, 0.749, 0.732)), "Se-e": ((0.43, 0.413, 0.446), (0.499, 0.536, 0.516)),
    "SiC": ((0.207, 0.211, 0.219), (0.835, 0.827, 0.814)), "SnTe": ((0.36, 0.13, 0.037), (0.599, 0.948, 1)),
    "Ta": ((0.392, 0.359, 0.407), (0.91, 0.769, 0.686)), "Te": ((0.55, 0.574, 0.572), (0.55, 0.574, 0.598)),
    "Te-e": ((0.629, 0.662, 0.656), (0.629, 0.662, 0.656)), "ThF4": ((0.049, 0.049, 0.05), (0.999, 0.999, 1)),
    "TiC": ((0.48, 0.451, 0.439), (0.626, 0.651, 0.675)), "TiN": ((0.605, 0.466, 0.248), (0.818, 0.987, 1)),
    "TiO2": ((0.235, 0.247, 0.273), (0.786, 0.766, 0.722)), "TiO2-e": ((0.199, 0.209, 0.232), (0.848, 0.83, 0.791)),
    "V": ((0.5, 0.516, 0.553), (0.571, 0.551, 0.598)), "VC": ((0.461, 0.43, 0.409), (0.638, 0.672, 0.699)),
    "VN": ((0.463, 0.408, 0.347), (0.724, 0.787, 0.847)), "W": ((0.504, 0.486, 0.459), (0.561, 0.582, 0.612)),
}
IOR = {
    "vacuum": 1.0, "helium": 1.000036, "hydrogen": 1.000132, "air": 1.000277, "carbon dioxide": 1.00045,
    "water": 1.333, "acetone": 1.36, "ethanol": 1.361, "carbon tetrachloride": 1.461, "glycerol": 1.4729,
    "benzene": 1.501, "silicone oil": 1.52045, "bromine": 1.661, "water ice": 1.31, "fused quartz": 1.458,
    "pyrex": 1.47, "acrylic glass": 1.49, "polypropylene": 1.49, "bk7": 1.5046, "sodium chloride": 1.544,
    "amber": 1.55, "pet": 1.575, "diamond": 2.419,
}
# fmt: on
