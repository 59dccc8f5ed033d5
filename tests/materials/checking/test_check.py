"""The check names faults and passes sound materials; every energy warning comes well below twice the light."""

from __future__ import annotations

import json
from functools import partial

import numpy as np
import pytest

from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.checking import check as module
from lambent.materials.checking.check import check, check_sampler, furnace
from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.fit import fit
from tests.materials.fitting.known_answers import FEW, PAINT, grey

FOIL = Material(
    kd=0.76,
    lobes=(
        Lobe(k=0.78, mx=0.124, my=0.136, r0=0.029, alpha=0.5),
        Lobe(side="transmission", k=0.67, mx=0.25, my=0.17, r0=0.75, alpha=0.6),
    ),
)
BRUSHED = Material(lobes=(Lobe(k=0.98, mx=0.0068, my=0.0297, r0=0.84, alpha=0.49),))


@pytest.fixture
def quick(monkeypatch):
    """One wo for the sampler, and two azimuths of the furnace, for speed."""
    monkeypatch.setattr(module, "SAMPLER_THETA_DEG", (45.0,))
    monkeypatch.setattr(module, "PHI_DEG", (0.0, 90.0))


def test_a_published_metal_passes_and_the_report_is_json():
    report = check(BRUSHED)
    assert report.passed and not report.warnings and report.reciprocity_error < 1e-9
    data = json.loads(json.dumps(report.to_json()))
    assert data["passed"] and np.shape(data["furnace"]["albedo"]) == (24, 4, 3) and len(data["sampler"]) == 3


def test_more_light_than_arrives_is_a_warning_with_its_angle(few_samples):
    report = check(FOIL)
    assert report.passed and "theta 89" in report.warnings[0] and report.furnace.highest[0] > 1.5


def test_a_material_that_would_light_up_a_room_fails(few_samples):
    report = check(Material(lobes=(Lobe(mx=0.5, my=0.5, r0=1, alpha=1),)))
    assert not report.passed and "without bound" in report.failures[0]


@pytest.fixture
def few_samples(quick, monkeypatch):
    monkeypatch.setattr(module, "check_sampler", partial(check_sampler, samples=1 << 16))


class NotReciprocal(MaterialBSDF):
    def eval(self, wi, wo):
        return super().eval(wi, wo) * (1 + 1e-3 * wi[..., 2:])


class WrongPdf(MaterialBSDF):
    def pdf(self, wi, wo):
        return 1.02 * super().pdf(wi, wo)


class LeavesAPartUnsampled(MaterialBSDF):
    """Sampler and pdf agree with each other, but never go to the far side, where f is not 0."""

    def __init__(self, material):
        super().__init__(material)
        self.near_side = MaterialBSDF(material.model_copy(update={"kt_d": (0.0, 0.0, 0.0)}))

    def pdf(self, wi, wo):
        return self.near_side.pdf(wi, wo)

    def sample(self, wo, u):
        return self.near_side.sample(wo, u)


@pytest.mark.parametrize(
    ("kind", "complaints"),
    [(NotReciprocal, ["not reciprocal"]), (WrongPdf, ["do not follow the density", "by quadrature"])],
)
def test_faults_are_named(quick, kind, complaints):
    said = "; ".join(check(kind(Material(kd=0.5, lobes=(Lobe(mx=0.3, my=0.2),)))).failures)
    assert all(complaint in said for complaint in complaints), said


def test_an_unsampled_part_shows_in_the_two_albedos(quick):
    report = check(LeavesAPartUnsampled(Material(kd=0.5, kt_d=0.2)))
    assert any("by sampling" in failure for failure in report.failures), report.failures
    assert not any("follow the density" in failure for failure in report.failures)


@pytest.mark.parametrize("theta_deg", [0.0, 60.0, 88.0])
def test_albedo_of_lambert_is_exact(theta_deg):
    one = check_sampler(MaterialBSDF(Material(kd=0.5, kt_d=0.25)), theta_deg, 10.0, samples=100_000)
    assert one.albedo_quadrature == pytest.approx(0.75, rel=1e-4) and one.pdf_integral == pytest.approx(1, abs=1e-4)


def test_furnace_of_a_tight_mirror():
    """A narrow lobe with alpha = 1/2 and r0 = 1 is a mirror: albedo 1 wherever the horizon cuts nothing off."""
    result = furnace(Material(lobes=(Lobe(mx=0.005, my=0.005, r0=1, alpha=0.5),)))
    below_85 = np.array(result.theta_deg) < 85
    np.testing.assert_allclose(result.albedo[below_85], 1, atol=2e-3)


def test_the_check_is_deterministic_and_shows_progress(few_samples):
    seen = []
    first = check(FOIL, seed=3, progress=lambda done, total, what: seen.append((done, total, what)))
    assert first.to_json() == check(FOIL, seed=3).to_json()
    assert seen[0][0] == 0 and seen[-1][0] == seen[-1][1]


@pytest.mark.parametrize(("kd", "warned"), [(0.5, False), (1.0, True)])
def test_a_fit_says_that_it_returns_more_than_arrives(kd: float, warned: bool) -> None:
    result = fit(grey(PAINT, FEW), fix={"kd": kd, "ks": 0.7, "mx": 0.15, "r0": 0.06, "alpha": 0.0})
    theta = np.radians([0.0, 45.0, 80.0])
    highest = MaterialBSDF(result.material).albedo(direction(theta, 0.0)).max()
    assert 1.02 < highest < 1.5 if warned else highest < 0.99
    assert any("scatters more light than it receives" in line for line in result.warnings) is warned
