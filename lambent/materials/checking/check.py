"""Check that a material suits a path tracer: reciprocity, energy, and a sampler that matches its density.

Energy: a directional albedo above 1 is a warning with its angle; with alpha > 0 the albedo grows towards grazing, as in
published fits. It is a failure only if the mean albedo over all directions (cosine-weighted, the bihemispherical
albedo) exceeds 1: by reciprocity, light between walls of such a material grows at every bounce, and a closed room has
no finite radiance. Below that, a high albedo only brightens grazing views.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from lambent.core.geometry.directions import Floats, direction
from lambent.core.plain import Triple
from lambent.core.progress import Progress, silent, stepper
from lambent.materials.bsdf import MaterialBSDF, cos_over_pdf, more_than_arrives
from lambent.materials.checking.chi_square import ChiSquare, adapted_cells, chi_square, integrate_cells
from lambent.materials.document import Material

THETA_DEG = (*range(0, 85, 5), 82, 84, 85, 86, 87, 88, 89)
PHI_DEG = (0.0, 45.0, 90.0, 135.0)
SAMPLER_THETA_DEG = (0.0, 45.0, 85.0)
PAIRS = 20_000  # random pairs, and as many sampled ones
RECIPROCITY_LIMIT = 1e-6  # float64 errors are 1e-12 for wide lobes and 1e-8 at the foot of the narrowest
P_VALUE_LIMIT = 1e-3  # per check, shared by its chi-square tests (Sidak)
INTEGRAL_LIMIT = 2e-3  # the quadrature error is a few 1e-4, even for slopes of .003 beside 1.5
ENERGY_LIMIT = 1 + 2e-3  # largest allowed mean albedo; the excess is the furnace's own error


class Scatters(Protocol):
    """A BSDF that can be checked: directions (..., 3) in; f (..., 3) in 1/sr, densities and directions out."""

    def eval(self, wi: Floats, wo: Floats) -> Floats: ...
    def pdf(self, wi: Floats, wo: Floats) -> Floats: ...
    def sample(self, wo: Floats, u: Floats) -> Floats: ...


@runtime_checkable
class KnowsItsSteps(Protocol):
    """A BSDF with a discontinuous density, which tests its own sampler in matching cells.

    `steps` returns cells (N, 4) of the light's directions within which f is smooth, or None if f is smooth everywhere.
    """

    def chi_square(self, wo: Floats, *, samples: int = 1_000_000, seed: int = 0) -> ChiSquare: ...
    def steps(self, wo: Floats) -> Floats | None: ...


@dataclass(frozen=True)
class Furnace:
    """Directional albedo (theta, phi, RGB) under uniform light of radiance 1, and its cosine-weighted mean."""

    theta_deg: tuple[float, ...]
    phi_deg: tuple[float, ...]
    albedo: Floats
    mean_albedo: Triple

    @property
    def highest(self) -> Triple:
        """Largest albedo, and its theta and phi in degrees."""
        t, p, c = np.unravel_index(int(np.argmax(self.albedo)), self.albedo.shape)
        return float(self.albedo[t, p, c]), self.theta_deg[t], self.phi_deg[p]


@dataclass(frozen=True)
class SamplerCheck:
    """The sampler compared with its density and value, for one wo. Albedos are means over RGB."""

    theta_deg: float
    phi_deg: float
    p_value: float
    pdf_integral: float
    rejected_share: float  # of samples at or below the horizon: 1 - pdf_integral up to noise
    albedo_quadrature: float
    albedo_sampled: float
    albedo_error: float  # standard error of albedo_sampled


@dataclass(frozen=True, kw_only=True)
class Report:
    """Results of all checks; `failures` and `warnings` describe the faults."""

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
    """Results for a material or a model."""

    reciprocity_error: float  # largest |f(wi, wo) - f(wo, wi)| over the larger of the two


def check(subject: Material | Scatters, seed: int = 0, progress: Progress = silent) -> CheckReport:
    """Check a material, or anything with eval, pdf and sample; a few seconds, deterministic for a seed."""
    bsdf = MaterialBSDF(subject) if isinstance(subject, Material) else subject
    step = stepper(progress, len(SAMPLER_THETA_DEG) + 2)
    step("reciprocity")
    error = reciprocity_error(bsdf, seed)
    step("energy")
    energy = furnace(bsdf, seed=seed)
    sampler = check_samplers(bsdf, seed, step)
    step("checked")

    failures, warnings = [], []
    if error > RECIPROCITY_LIMIT:
        failures.append(f"not reciprocal: swapping wi and wo changes f by up to {error:.2g} of its value")
    albedo, theta, phi = energy.highest
    if more_than_arrives(energy.albedo).any():
        at = f"theta {theta:g}, phi {phi:g} degrees"
        warnings.append(f"reflects {albedo:.3f} of the light at {at}: more than arrives")
    return CheckReport(
        reciprocity_error=error,
        furnace=energy,
        sampler=sampler,
        warnings=tuple(warnings),
        failures=(*failures, *energy_failures(energy, ENERGY_LIMIT), *sampler_failures(sampler)),
    )


def check_samplers(bsdf: Scatters, seed: int, step: Callable[[str], None]) -> tuple[SamplerCheck, ...]:
    """`check_sampler` at every SAMPLER_THETA_DEG, each reported to `step`."""
    found = []
    for i, theta in enumerate(SAMPLER_THETA_DEG):
        step(f"sampler at {theta:g} degrees")
        found.append(check_sampler(bsdf, theta, 20.0 + 50 * i, seed=seed + i))
    return tuple(found)


def energy_failures(energy: Furnace, limit: float) -> list[str]:
    """A line where the mean albedo exceeds `limit`, else none."""
    highest = max(energy.mean_albedo)
    return [f"mean albedo {highest:.3f}: interreflections grow without bound"] if highest > limit else []


def sampler_failures(sampler: tuple[SamplerCheck, ...]) -> list[str]:
    """A line for every fault of the sampler."""
    found = []
    least = 1 - (1 - P_VALUE_LIMIT) ** (1 / len(sampler))
    for one in sampler:
        where = f"at theta {one.theta_deg:g}, phi {one.phi_deg:g} degrees"
        if one.p_value < least:
            found.append(f"samples do not follow the density {where} (chi-square p {one.p_value:.2g})")
        if abs(one.pdf_integral + one.rejected_share - 1) > INTEGRAL_LIMIT:
            kept = 1 - one.rejected_share
            found.append(
                f"the density integrates to {one.pdf_integral:.4f} {where}, but the sampler accepts {kept:.4f} of "
                "its samples"
            )
        tolerance = 5 * one.albedo_error + INTEGRAL_LIMIT * max(one.albedo_quadrature, INTEGRAL_LIMIT)
        if abs(one.albedo_sampled - one.albedo_quadrature) > tolerance:
            both = f"{one.albedo_sampled:.4f} by sampling, {one.albedo_quadrature:.4f} by quadrature"
            found.append(f"albedo {both} {where}")
    return found


def reciprocity_error(bsdf: Scatters, seed: int = 0) -> float:
    """Largest relative change of f when wi and wo are swapped, over random pairs and sampled pairs.

    Values below 1e-9 of the largest are raised to that, because rounding dominates at the foot of a narrow lobe.
    """
    rng = np.random.default_rng(seed)
    wo, wi = _sphere(rng, 2 * PAIRS), _sphere(rng, 2 * PAIRS)
    wi[PAIRS:] = bsdf.sample(wo[PAIRS:], rng.random((PAIRS, 3)))
    usable = (np.abs(wi[:, 2]) > 1e-3) & (np.abs(wo[:, 2]) > 1e-3)
    forth, back = bsdf.eval(wi[usable], wo[usable]), bsdf.eval(wo[usable], wi[usable])
    size = np.maximum(np.abs(forth), np.abs(back))
    floor = max(1e-9 * float(size.max(initial=0.0)), 1e-30)
    return float((np.abs(forth - back) / np.maximum(size, floor)).max(initial=0.0))


def _sphere(rng: np.random.Generator, n: int) -> Floats:
    z, phi = rng.uniform(-1, 1, n), rng.uniform(0, 2 * np.pi, n)
    return direction(np.arccos(z), phi)


def furnace(subject: Material | Scatters, *, samples: int = 1 << 14, seed: int = 0) -> Furnace:
    """Directional albedo over theta 0..89 degrees by importance sampling with scrambled Sobol points, unclipped."""
    from scipy.stats import qmc

    bsdf = MaterialBSDF(subject) if isinstance(subject, Material) else subject
    u = qmc.Sobol(3, rng=np.random.default_rng(seed)).random(samples)
    wo = direction(*np.radians(np.meshgrid(THETA_DEG, PHI_DEG, indexing="ij")))
    albedo = np.array([[_weights(bsdf, w, u).mean(axis=0) for w in row] for row in wo])
    return Furnace(tuple(map(float, THETA_DEG)), PHI_DEG, albedo, mean_albedo(albedo))


def mean_albedo(albedo: Floats) -> Triple:
    """Cosine-weighted mean of a directional albedo (THETA_DEG, phi, 3); beyond 89 degrees, the value at 89 is used."""
    sin2 = np.append(np.sin(np.radians(THETA_DEG)) ** 2, 1.0)
    rows = np.concatenate([albedo, albedo[-1:]]).mean(axis=1)
    red, green, blue = (float(np.trapezoid(rows[:, c], sin2)) for c in range(3))
    return red, green, blue


def _weights(bsdf: Scatters, wo: Floats, u: Floats) -> Floats:
    """f |cos theta_i| / pdf (n, 3) of the samples of u (n, 3); 0 for rejected samples."""
    wo = np.broadcast_to(wo, u.shape)
    wi = bsdf.sample(wo, u)
    return np.asarray(bsdf.eval(wi, wo) * cos_over_pdf(wi, bsdf.pdf(wi, wo))[:, None])


def check_sampler(
    bsdf: Scatters, theta_deg: float, phi_deg: float, *, samples: int = 1_000_000, seed: int = 0
) -> SamplerCheck:
    """Chi-square of the sampler, the integral of its density, and the albedo by two independent methods."""
    wo = direction(np.radians(theta_deg), np.radians(phi_deg))

    def draw(u: Floats) -> Floats:
        return bsdf.sample(np.broadcast_to(wo, u.shape), u)

    if isinstance(bsdf, KnowsItsSteps):
        test, cells = bsdf.chi_square(wo, samples=samples, seed=seed), bsdf.steps(wo)
    else:
        cells = None
        test = chi_square(draw, lambda w: bsdf.pdf(w, np.broadcast_to(wo, w.shape)), samples=samples, seed=seed)
    rng = np.random.default_rng(seed)
    pilot = draw(rng.random((samples // 16, 3)))
    quadrature = albedo_by_quadrature(lambda w: bsdf.eval(w, np.broadcast_to(wo, w.shape)), pilot, cells)
    weights = _weights(bsdf, wo, rng.random((samples // 4, 3))).mean(axis=-1)
    sampled, error = float(weights.mean()), float(weights.std() / np.sqrt(len(weights)))
    return SamplerCheck(
        theta_deg, phi_deg, test.p_value, test.pdf_integral, test.rejected_share, quadrature, sampled, error
    )


def albedo_by_quadrature(f: Callable[[Floats], Floats], pilot: Floats, cells: Floats | None) -> float:
    """Adaptive quadrature of the mean over channels of f (..., C) times |cos theta|; see `integrate_cells`."""

    def integrand(w: Floats) -> Floats:
        return np.asarray(f(w).mean(axis=-1) * np.abs(w[..., 2]))

    return float(integrate_cells(integrand, adapted_cells(pilot) if cells is None else cells, pilot).sum())
