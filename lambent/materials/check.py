"""Is a material fit for a path tracer? Reciprocity, energy, and a sampler that draws what its density says.

Energy: a directional albedo over 1 is a warning with its angle, because alpha > 0 makes it grow towards grazing and
published fits do so. It is a failure only where the albedo averaged over all directions (cosine-weighted, the
bihemispherical albedo) exceeds 1: by reciprocity the light between walls of such a material then grows at every
bounce, and a closed room of it has no finite radiance. Below that, a warning costs brightness at grazing and no more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from lambent.core.directions import direction
from lambent.core.progress import Progress, silent
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.chi_square import ChiSquare, adapted_cells, chi_square, integrate_cells
from lambent.materials.document import Material

Floats = NDArray[np.floating]

THETA_DEG = (*range(0, 85, 5), 82, 84, 85, 86, 87, 88, 89)
PHI_DEG = (0.0, 45.0, 90.0, 135.0)
SAMPLER_THETA_DEG = (0.0, 45.0, 85.0)
RECIPROCITY_LIMIT = 1e-6  # float64 leaves 1e-12 for wide lobes and 1e-8 at the foot of the narrowest
P_VALUE_LIMIT = 1e-3  # per check, shared by its chi-square tests (Sidak)
INTEGRAL_LIMIT = 2e-3  # quadrature is good to a few 1e-4 even for slopes of .003 beside 1.5
ENERGY_LIMIT = 1 + 2e-3  # the furnace's own error


class Scatters(Protocol):
    """What can be checked: arrays of directions (..., 3) in, f (..., 3) in 1/sr, densities and directions out."""

    def eval(self, wi: Floats, wo: Floats) -> Floats: ...
    def pdf(self, wi: Floats, wo: Floats) -> Floats: ...
    def sample(self, wo: Floats, u: Floats) -> Floats: ...


@runtime_checkable
class KnowsItsSteps(Protocol):
    """A density with steps, which tests its own sampler in cells along them.

    `steps` are cells (N, 4) of the light's directions within which f is smooth, or None where it is throughout.
    """

    def chi_square(self, wo: Floats, *, samples: int = 1_000_000, seed: int = 0) -> ChiSquare: ...
    def steps(self, wo: Floats) -> Floats | None: ...


@dataclass(frozen=True)
class Furnace:
    """Directional albedo (theta, phi, RGB) under uniform light of radiance 1, and its cosine-weighted mean."""

    theta_deg: tuple[float, ...]
    phi_deg: tuple[float, ...]
    albedo: Floats
    mean_albedo: tuple[float, float, float]

    @property
    def highest(self) -> tuple[float, float, float]:
        """Largest albedo, and theta and phi in degrees where it is."""
        t, p, c = np.unravel_index(int(np.argmax(self.albedo)), self.albedo.shape)
        return float(self.albedo[t, p, c]), self.theta_deg[t], self.phi_deg[p]


@dataclass(frozen=True)
class SamplerCheck:
    """Sampler against density and value, for one wo. Albedos are the mean of RGB."""

    theta_deg: float
    phi_deg: float
    p_value: float
    pdf_integral: float
    rejected_share: float  # of samples at or below the horizon: 1 - pdf_integral but for noise
    albedo_quadrature: float
    albedo_sampled: float
    albedo_error: float  # standard error of albedo_sampled


@dataclass(frozen=True, kw_only=True)
class Report:
    """What every check measures; `failures` and `warnings` say in words what is wrong."""

    furnace: Furnace
    sampler: tuple[SamplerCheck, ...]
    warnings: tuple[str, ...]
    failures: tuple[str, ...]

    @property
    def passed(self) -> bool:
        return not self.failures

    def to_json(self) -> dict[str, Any]:
        """The report as plain numbers, strings and lists."""
        data = asdict(self) | {"passed": self.passed}
        data["furnace"]["albedo"] = self.furnace.albedo.tolist()
        return data


@dataclass(frozen=True, kw_only=True)
class CheckReport(Report):
    """Of a material or a model."""

    reciprocity_error: float  # largest |f(wi, wo) - f(wo, wi)| over the larger of the two


def check(subject: Material | Scatters, seed: int = 0, progress: Progress = silent) -> CheckReport:
    """Check a material, or anything with eval, pdf and sample; a few seconds, deterministic for a seed."""
    bsdf = MaterialBSDF(subject) if isinstance(subject, Material) else subject
    steps = len(SAMPLER_THETA_DEG) + 2
    progress(0, steps, "reciprocity")
    error = reciprocity_error(bsdf, seed)
    progress(1, steps, "energy")
    energy = furnace(bsdf, seed=seed)
    sampler = []
    for i, theta in enumerate(SAMPLER_THETA_DEG):
        progress(2 + i, steps, f"sampler at {theta:g} degrees")
        sampler.append(check_sampler(bsdf, theta, 20.0 + 50 * i, seed=seed + i))
    progress(steps, steps, "checked")

    failures = _failures(error, energy, sampler)
    warnings = []
    albedo, theta, phi = energy.highest
    if albedo > ENERGY_LIMIT:
        warnings.append(
            f"reflects {albedo:.3f} of the light at theta {theta:g}, phi {phi:g} degrees: more than arrives"
        )
    return CheckReport(
        reciprocity_error=error,
        furnace=energy,
        sampler=tuple(sampler),
        warnings=tuple(warnings),
        failures=tuple(failures),
    )


def _failures(error: float, energy: Furnace, sampler: list[SamplerCheck]) -> list[str]:
    found = []
    if error > RECIPROCITY_LIMIT:
        found.append(f"not reciprocal: swapping wi and wo changes f by up to {error:.2g} of its value")
    if max(energy.mean_albedo) > ENERGY_LIMIT:
        found.append(f"mean albedo {max(energy.mean_albedo):.3f}: light between such walls grows without bound")
    return found + sampler_failures(sampler)


def sampler_failures(sampler: list[SamplerCheck]) -> list[str]:
    """What is wrong with the sampler, in words; empty where nothing is."""
    found = []
    least = 1 - (1 - P_VALUE_LIMIT) ** (1 / len(sampler))
    for one in sampler:
        where = f"at theta {one.theta_deg:g}, phi {one.phi_deg:g} degrees"
        if one.p_value < least:
            found.append(f"samples do not follow the density {where} (chi-square p {one.p_value:.2g})")
        if abs(one.pdf_integral + one.rejected_share - 1) > INTEGRAL_LIMIT:
            kept = 1 - one.rejected_share
            found.append(f"the density integrates to {one.pdf_integral:.4f} {where}, the sampler keeps {kept:.4f}")
        tolerance = 5 * one.albedo_error + INTEGRAL_LIMIT * one.albedo_quadrature
        if abs(one.albedo_sampled - one.albedo_quadrature) > tolerance:
            found.append(
                f"albedo {one.albedo_sampled:.4f} by sampling, {one.albedo_quadrature:.4f} by quadrature {where}"
            )
    return found


def reciprocity_error(bsdf: Scatters, seed: int = 0, pairs: int = 20_000) -> float:
    """Largest relative change of f when wi and wo are swapped, over random pairs and pairs that the sampler likes.

    Values below 1e-9 of the largest count as if they were that large: at the foot of a narrow lobe rounding is all.
    """
    rng = np.random.default_rng(seed)
    wo, wi = _sphere(rng, 2 * pairs), _sphere(rng, 2 * pairs)
    wi[pairs:] = bsdf.sample(wo[pairs:], rng.random((pairs, 3)))
    usable = (np.abs(wi[:, 2]) > 1e-3) & (np.abs(wo[:, 2]) > 1e-3)
    forth, back = bsdf.eval(wi[usable], wo[usable]), bsdf.eval(wo[usable], wi[usable])
    size = np.maximum(np.abs(forth), np.abs(back))
    floor = max(1e-9 * float(size.max(initial=0.0)), 1e-30)
    return float((np.abs(forth - back) / np.maximum(size, floor)).max(initial=0.0))


def _sphere(rng: np.random.Generator, n: int) -> Floats:
    z, phi = rng.uniform(-1, 1, n), rng.uniform(0, 2 * np.pi, n)
    return direction(np.arccos(z), phi)


def furnace(subject: Material | Scatters, *, samples: int = 1 << 14, seed: int = 0) -> Furnace:
    """Directional albedo over theta 0..89 degrees by importance sampling with scrambled Sobol points.

    Nothing is clipped.
    """
    from scipy.stats import qmc

    bsdf = MaterialBSDF(subject) if isinstance(subject, Material) else subject
    u = qmc.Sobol(3, rng=np.random.default_rng(seed)).random(samples)
    albedo = np.array(
        [[_weights(bsdf, direction(np.radians(t), np.radians(p)), u).mean(axis=0) for p in PHI_DEG] for t in THETA_DEG]
    )
    return Furnace(tuple(map(float, THETA_DEG)), PHI_DEG, albedo, mean_albedo(albedo))


def mean_albedo(albedo: Floats) -> tuple[float, float, float]:
    """Mean of a directional albedo (THETA_DEG, phi, 3), weighed with the cosine; the last degree counts like 89."""
    sin2 = np.append(np.sin(np.radians(THETA_DEG)) ** 2, 1.0)
    rows = np.concatenate([albedo, albedo[-1:]]).mean(axis=1)
    red, green, blue = (float(np.trapezoid(rows[:, c], sin2)) for c in range(3))
    return red, green, blue


def _weights(bsdf: Scatters, wo: Floats, u: Floats) -> Floats:
    """f |cos theta_i| / pdf (n, 3) of the samples of u (n, 3); 0 where the sample was rejected."""
    wo = np.broadcast_to(wo, u.shape)
    wi = bsdf.sample(wo, u)
    p = bsdf.pdf(wi, wo)
    scale = np.divide(np.abs(wi[:, 2]), p, out=np.zeros_like(p), where=p > 0)
    return np.asarray(bsdf.eval(wi, wo) * scale[:, None])


def check_sampler(
    bsdf: Scatters, theta_deg: float, phi_deg: float, *, samples: int = 1_000_000, seed: int = 0
) -> SamplerCheck:
    """Chi-square of the sampler, integral of its density, and the albedo found in two independent ways."""
    wo = direction(np.radians(theta_deg), np.radians(phi_deg))

    def seen_from_wo(function: Callable[[Floats, Floats], Floats]) -> Callable[[Floats], Floats]:
        return lambda w: function(w, np.broadcast_to(wo, w.shape))

    def draw(u: Floats) -> Floats:
        return bsdf.sample(np.broadcast_to(wo, u.shape), u)

    def returned(w: Floats) -> Floats:
        return np.asarray(bsdf.eval(w, np.broadcast_to(wo, w.shape)).mean(axis=-1) * np.abs(w[..., 2]))

    if isinstance(bsdf, KnowsItsSteps):
        test, cells = bsdf.chi_square(wo, samples=samples, seed=seed), bsdf.steps(wo)
    else:
        cells = None
        test = chi_square(draw, seen_from_wo(bsdf.pdf), samples=samples, seed=seed)
    rng = np.random.default_rng(seed)
    pilot = draw(rng.random((samples // 16, 3)))
    quadrature = float(integrate_cells(returned, adapted_cells(pilot) if cells is None else cells, pilot).sum())
    weights = _weights(bsdf, wo, rng.random((samples // 4, 3))).mean(axis=-1)
    sampled, error = float(weights.mean()), float(weights.std() / np.sqrt(len(weights)))
    return SamplerCheck(
        theta_deg, phi_deg, test.p_value, test.pdf_integral, test.rejected_share, quadrature, sampled, error
    )
