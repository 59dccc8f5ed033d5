"""The diffuse term that falls as Fresnel rises: its albedo is known exactly."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF, coupling, under_fresnel
from lambent.materials.checking.check import check, check_sampler
from lambent.materials.document import Lobe, Material, load_material, material_from
from lambent.materials.lobes import fresnel

KD = (0.2, 0.4, 0.8)
COUPLED = Material(kd=KD, kd_coupled=True, kt_d=0.1)


@pytest.mark.parametrize("r0", [0.0, 0.04, 0.7])
def test_r0_drops_out(r0):
    cosine = np.linspace(0, 1, 50)
    np.testing.assert_allclose(under_fresnel(cosine), (1 - fresnel(cosine, r0)) / (1 - r0), atol=1e-14)


def test_nothing_cancels_at_grazing():
    assert under_fresnel(1e-12) == pytest.approx(5e-12, rel=1e-9)


@pytest.mark.parametrize("theta_deg", [0.0, 45.0, 80.0, 89.0])
def test_the_albedo_is_kd_times_the_transmittance(theta_deg):
    """Gauss-Legendre over theta_i: the integrand is a polynomial of degree 6 in cos(theta_i), so it is exact."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    cos_i = (nodes + 1) / 2
    wo, wi = direction(np.radians(theta_deg), 0.7), direction(np.arccos(cos_i), 0.1)
    f = MaterialBSDF(COUPLED).eval(wi, np.broadcast_to(wo, wi.shape))
    albedo = np.pi * (weights * cos_i) @ f
    np.testing.assert_allclose(albedo, np.array(KD) * under_fresnel(wo[2]), rtol=1e-12)
    one = check_sampler(MaterialBSDF(COUPLED), theta_deg, 20.0, samples=100_000)
    expected = np.mean(KD) * under_fresnel(wo[2]) + 0.1
    assert one.albedo_quadrature == pytest.approx(expected, rel=1e-3)
    assert one.albedo_sampled == pytest.approx(expected, abs=5 * one.albedo_error + 1e-4)


def test_reciprocal_with_a_correct_sampler():
    report = check(Material(kd=KD, kd_coupled=True, lobes=(Lobe(mx=0.2, my=0.1, r0=0.04),)))
    assert report.passed and report.reciprocity_error < 1e-12


def test_the_factor_has_mean_one_under_uniform_light():
    cosine = np.sqrt(np.linspace(0, 1, 100_001))  # even in cos^2: weighted with the cosine
    assert np.mean(coupling(cosine, 1.0)) == pytest.approx(1, abs=1e-4)


def test_documents_store_the_coupling_and_old_ones_are_read(tmp_path):
    COUPLED.save(tmp_path / "m.json")
    assert load_material(tmp_path / "m.json") == COUPLED
    assert not material_from({"kd": 0.5}, "old").kd_coupled
    with pytest.raises(UserError, match="kd_coupled"):
        material_from({"kd": 0.5, "kd_coupled": 0.3}, "x")


def test_a_document_without_scattering_terms_is_refused():
    with pytest.raises(UserError, match="no scattering term"):
        material_from({"name": "x"}, "x.json")
    for black in ({"kd": 0}, {"kt_d": [0, 0, 0]}, {"lobes": []}):
        assert material_from(black, "x.json").kd == (0, 0, 0)
