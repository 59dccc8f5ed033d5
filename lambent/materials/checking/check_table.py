"""Check that a measured table suits a path tracer, within the accuracy of a measurement.

A table is reciprocal only to the accuracy of its device, not to 1e-6: swapping wi and wo changes published RGL files by
3 to 22 % of the light. Its albedo may exceed 1 near grazing, where device errors dominate. The report therefore gives
percentages, and only faults beyond any device's errors are failures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.core.geometry.directions import Floats, direction
from lambent.core.geometry.sequences import cosine_hemisphere
from lambent.core.progress import Progress, silent, stepper
from lambent.materials.bsdf import more_than_arrives
from lambent.materials.checking import check
from lambent.materials.checking.check import PHI_DEG, THETA_DEG, Furnace, Report, mean_albedo
from lambent.materials.measured.inspecting.inspection import extrapolation
from lambent.materials.measured.protocol import MeasuredTable, negative_readings
from lambent.materials.measured.tables.half_vector_grid import GridShape
from lambent.materials.measured.tables.patch_sheet import TableBSDF

PAIRS = 60_000
RECIPROCITY_LIMIT = 0.5  # share of the light; the worst published file has .22, swapped columns have 1 and more
ENERGY_LIMIT = 1.02  # largest allowed mean albedo: that of a white tile measured by a good device
INTEGRAL_LIMIT = 0.05  # relative difference between reflectivity() and an independent quadrature
INTEGRAL_THETA_DEG = (10.0, 40.0, 70.0)
LAST_THETA_DEG = 84.0  # energy beyond is only a warning


@dataclass(frozen=True)
class IntegralCheck:
    """r + t of one incident direction by the table's own methods and by adaptive quadrature; means of RGB."""

    theta_deg: float
    phi_deg: float
    from_table: float
    quadrature: float

    @property
    def deviation(self) -> float:
        """Relative difference of the two to the quadrature."""
        return abs(self.from_table - self.quadrature) / max(self.quadrature, 1e-12)


@dataclass(frozen=True, kw_only=True)
class TableReport(Report):
    """Results for a measured table; `furnace` is r + t over the incident directions, by the table's own methods.

    Attributes
    ----------
    reciprocity_share : float
        Integral of |f(wi, wo) - f(wo, wi)| cos cos over that of the mean of both, reflection only.
    resampling_share : float
        Deviation of the path tracer's look-up from the table itself, as a share of the light.
    tuples : dict of int
        Numbers of raw tuples: used, below zero among these, and left out by reason.
    negative_readings : str
        A description of the readings below zero, which are not a fault; empty if there are none.
    """

    reciprocity_share: float
    resampling_share: float
    integrals: tuple[IntegralCheck, ...]
    tuples: dict[str, int]
    negative_readings: str


def check_table(
    table: MeasuredTable, seed: int = 0, progress: Progress = silent, shape: GridShape | None = None
) -> TableReport:
    """Check a measured table; ten seconds to two minutes, by the format's `eval`; deterministic for a seed."""
    bsdf = TableBSDF(table, shape, progress)
    step = stepper(progress, len(INTEGRAL_THETA_DEG) + len(check.SAMPLER_THETA_DEG) + 2)
    step("reciprocity")
    reciprocity, resampling = asymmetry(bsdf, seed)
    step("energy")
    energy = albedos(table)
    integrals = []
    for i, theta in enumerate(INTEGRAL_THETA_DEG):
        step(f"albedo at {theta:g} degrees")
        integrals.append(check_integral(bsdf, theta, 20.0 + 50 * i, seed))
    sampler = check.check_samplers(bsdf, seed, step)
    samples = table.samples()
    step("checked")
    return TableReport(
        reciprocity_share=reciprocity,
        resampling_share=resampling,
        furnace=energy,
        integrals=tuple(integrals),
        tuples=samples.counts,
        negative_readings=negative_readings(samples),
        sampler=sampler,
        warnings=(*_warnings(resampling, energy), *extrapolation(table)[1]),
        failures=(*_failures(reciprocity, energy, integrals), *check.sampler_failures(sampler)),
    )


def asymmetry(bsdf: TableBSDF, seed: int = 0) -> tuple[float, float]:
    """Differences of f(wi, wo), as shares of the light: from f(wo, wi) in reflection, and from the look-up overall.

    Importance sampled: wo by its cosine, wi by the table's sampler; both within LAST_THETA_DEG.
    """
    rng = np.random.default_rng(seed)
    wo = cosine_hemisphere(rng.random((PAIRS, 2)))
    wi = bsdf.sample(wo, rng.random((PAIRS, 3)))
    lowest = np.cos(np.radians(LAST_THETA_DEG))
    pdf = bsdf.pdf(wi, wo)
    used = (np.abs(wi[:, 2]) > lowest) & (wo[:, 2] > lowest) & (pdf > 0)
    wi, wo = wi[used], wo[used]
    near = wi[:, 2] > 0
    gain = (np.abs(wi[:, 2]) / pdf[used])[:, None]
    f, swapped = bsdf.eval(wi, wo), bsdf.eval(wo[near], wi[near])
    looked_up = bsdf.looked_up(wi, wo)
    changed = (np.abs(swapped - f[near]) * gain[near]).sum() / max(((swapped + f[near]) / 2 * gain[near]).sum(), 1e-30)
    return float(changed), float((np.abs(looked_up - f) * gain).sum() / max((f * gain).sum(), 1e-30))


def albedos(table: MeasuredTable) -> Furnace:
    """r + t of a table up to 89 degrees, at one azimuth for an isotropic table, else at four."""
    phi_deg = PHI_DEG[:1] if table.info.isotropic else PHI_DEG
    wi = direction(*np.radians(np.meshgrid(THETA_DEG, phi_deg, indexing="ij")))
    albedo = np.broadcast_to(table.albedo(wi), wi.shape)
    return Furnace(tuple(map(float, THETA_DEG)), phi_deg, albedo, mean_albedo(albedo))


def check_integral(bsdf: TableBSDF, theta_deg: float, phi_deg: float, seed: int = 0) -> IntegralCheck:
    """Compare the table's own r + t at an incident direction with an adaptive quadrature of f cos(theta_o)."""
    wi = direction(np.radians(theta_deg), np.radians(phi_deg))

    def f(wo: Floats) -> Floats:
        return bsdf.eval(np.broadcast_to(wi, wo.shape), wo)

    pilot = bsdf.sample(np.broadcast_to(wi, (1 << 15, 3)), np.random.default_rng(seed).random((1 << 15, 3)))
    quadrature = check.albedo_by_quadrature(f, pilot, bsdf.steps(wi, reverse=True))
    return IntegralCheck(theta_deg, phi_deg, float(bsdf.sheet.table.albedo(wi).mean()), quadrature)


def _failures(reciprocity: float, energy: Furnace, integrals: list[IntegralCheck]) -> list[str]:
    found = []
    if reciprocity > RECIPROCITY_LIMIT:
        found.append(f"swapping wi and wo changes {reciprocity:.0%} of the light: columns mixed up, or not reflection")
    found += check.energy_failures(energy, ENERGY_LIMIT)
    for one in integrals:
        if one.deviation > INTEGRAL_LIMIT:
            both = f"r + t is {one.from_table:.4f}, its quadrature {one.quadrature:.4f}"
            found.append(f"{both} at theta {one.theta_deg:g} degrees")
    return found


def _warnings(resampling: float, energy: Furnace) -> list[str]:
    found = []
    albedo, theta, phi = energy.highest
    if more_than_arrives(energy.albedo).any():
        where = "beyond what was measured well" if theta > LAST_THETA_DEG else "more than arrives"
        found.append(f"returns {albedo:.3f} of the light at theta {theta:g}, phi {phi:g} degrees: {where}")
    if resampling > 0.05:
        share = f"{resampling:.0%} of the light"
        found.append(f"the path tracer's look-up deviates from the table by {share}: steps or spikes")
    return found
