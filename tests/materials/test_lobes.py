"""Lobes and whole materials: sampler, density and value agree; the diffuse term falls as Fresnel reflection rises."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry import directions
from lambent.core.geometry.directions import direction
from lambent.materials import lobes
from lambent.materials.bsdf import MaterialBSDF, components, coupling, selection, specular_only, under_fresnel
from lambent.materials.checking.check import RECIPROCITY_LIMIT, check_sampler, reciprocity_error
from lambent.materials.document import Lobe, Material, load_material, material_from
from lambent.materials.lobes import fresnel
from tests.tools.checks import assert_reciprocal, assert_sampler

MIXTURES = {
    "diffuse": Material(kd=0.5, kt_d=0.3),
    "coupled": Material(kd=(0.2, 0.4, 0.8), kd_coupled=True, lobes=(Lobe(mx=0.2, my=0.1, r0=0.04),)),
    "two lobes": Material(
        kd=0.003,
        lobes=(
            Lobe(k=0.57, mx=0.0046, my=0.0267, r0=0.94, alpha=0.5),
            Lobe(k=0.54, mx=0.013, my=0.1199, r0=0.84, alpha=0.38),
        ),
    ),
    "foil": Material(
        kd=0.3,
        kt_d=0.1,
        lobes=(
            Lobe(k=0.78, mx=0.124, my=0.136, r0=0.029, alpha=0.5),
            Lobe(k=0.67, mx=0.25, my=0.17, r0=0.75, alpha=0.6, side="transmission", distribution="ggx"),
        ),
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("theta_deg", [0.0, 50.0, 85.0, 130.0], ids=["normal", "oblique", "grazing", "from below"])
@pytest.mark.parametrize("name", MIXTURES)
def test_samplers_of_mixtures_follow_their_density(name, theta_deg):
    assert_sampler(MaterialBSDF(MIXTURES[name]), theta_deg, 200.0)


@pytest.mark.parametrize("name", MIXTURES)
def test_mixtures_are_reciprocal(name):
    assert_reciprocal(MaterialBSDF(MIXTURES[name]))


def test_a_lobe_that_crosses_the_horizon_is_rejected():
    """Its samples must not count as diffuse transmission on the far side, which would be too bright."""
    bsdf = MaterialBSDF(Material(kt_d=0.5, lobes=(Lobe(mx=1.0, my=1.0, r0=0.9),)))
    wo = np.tile(direction(np.radians(80), 0.0), (100_000, 1))
    u = np.random.default_rng(0).random(wo.shape)
    wi = bsdf.sample(wo, u)
    from_lobe = u[:, 0] >= selection(components(wo), bsdf.material)[1]
    rejected = from_lobe & (wi[:, 2] == 0)
    assert rejected.mean() > 0.05 and not (from_lobe & (wi[:, 2] < 0)).any()
    assert (bsdf.pdf(wi, wo)[rejected] == 0).all() and (bsdf.eval(wi, wo)[rejected] == 0).all()


def test_no_lobe_is_left_unsampled_where_fresnel_vanishes_at_wo():
    """r0 = 0 at normal incidence: F(wo.n) is 0, f is not."""
    bsdf = MaterialBSDF(Material(lobes=(Lobe(mx=1.5, my=1.5, r0=0.0),)))
    wo, wi = direction(0.0, 0.0), direction(1.2, 0.3)
    assert bsdf.eval(wi, wo).min() > 0 and bsdf.pdf(wi, wo) > 0


@pytest.mark.parametrize("name", MIXTURES)
def test_selection_is_a_probability(name):
    wo = direction(np.linspace(0, np.pi, 50), 0.3)
    total = sum(selection(components(wo), MIXTURES[name]))
    np.testing.assert_allclose(total, 1, rtol=1e-12)


def test_black_material_is_black_and_finite():
    bsdf = MaterialBSDF(Material())
    wo = np.tile(direction(0.5, 0.0), (100, 1))
    wi = bsdf.sample(wo, np.random.default_rng(0).random((100, 3)))
    assert np.isfinite(wi).all() and (bsdf.pdf(wi, wo) == 0).all() and (bsdf.eval(wi, wo) == 0).all()


def test_albedo_of_diffuse_is_its_coefficient():
    material = Material(kd=(0.2, 0.4, 0.6), kt_d=0.1)
    albedo = MaterialBSDF(material).albedo(direction(0.7, 0.1), samples=100_000)
    np.testing.assert_allclose(albedo, [0.3, 0.5, 0.7], rtol=0.01)
    assert not MaterialBSDF(specular_only(material)).albedo(direction(0.7, 0.1)).any()


def test_float32_input_is_computed_in_float64():
    wo, wi = direction(0.5, 0.0).astype(np.float32), direction(0.6, 3.0).astype(np.float32)
    assert MaterialBSDF(MIXTURES["foil"]).eval(wi, wo).dtype == np.float64


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


SHAPES = {
    "isotropic": {"mx": 0.3, "my": 0.3},
    "anisotropic": {"mx": 0.05, "my": 0.4, "alpha": 0.43},
    "narrow": {"mx": 0.005, "my": 0.005, "alpha": 0.5},
    "brushed": {"mx": 0.0068, "my": 0.0297},
    "extreme": {"mx": 0.003, "my": 1.5},
}
RETRO = {
    "beads": {"mx": 0.06, "my": 0.06, "alpha": -2.0, "distribution": "ggx"},
    "prisms": {"mx": 0.005, "my": 0.01, "alpha": -4.0},
}
LOBES = {
    f"{name}-{distribution}-{side}": Lobe(side=side, distribution=distribution, r0=0.5, **shape)
    for name, shape in SHAPES.items()
    for distribution in ("beckmann", "ggx")
    for side in ("reflection", "transmission")
    if side == "reflection" or name in ("isotropic", "brushed")
} | {f"retro-{name}": Lobe(retro=True, r0=0.5, **shape) for name, shape in RETRO.items()}


def pairs(count=2000, seed=0):
    rng = np.random.default_rng(seed)
    u = rng.random((2, 2, count))
    return [direction(np.arccos(2 * z - 1), 2 * np.pi * phi) for z, phi in u]


@pytest.mark.slow
@pytest.mark.parametrize("theta_deg", [50.0, 85.0], ids=["oblique", "grazing"])
@pytest.mark.parametrize("name", LOBES)
def test_sampler_follows_its_density(name, theta_deg):
    assert_sampler(MaterialBSDF(Material(lobes=(LOBES[name],))), theta_deg, 30.0)


@pytest.mark.parametrize("name", LOBES)
def test_reciprocal(name):
    assert reciprocity_error(MaterialBSDF(Material(lobes=(LOBES[name],)))) < RECIPROCITY_LIMIT


@pytest.mark.long
def test_a_pdf_wrong_by_two_per_cent_is_noticed():
    right = MaterialBSDF(Material(lobes=(Lobe(mx=0.2, my=0.2),)))

    class TooHigh(MaterialBSDF):
        def pdf(self, wi, wo):
            return 1.02 * super().pdf(wi, wo)

    assert_sampler(right, 40, 0)
    with pytest.raises(AssertionError, match="do not follow the density"):
        assert_sampler(TooHigh(right.material), 40, 0)


def test_values_by_hand():
    """Normal incidence and exitance: f = r0 / (4 pi mx my); GGX has the same peak; transmission has 1 - r0."""
    n = (0.0, 0.0, 1.0)
    for distribution in ("beckmann", "ggx"):
        lobe = Lobe(mx=0.1, my=0.2, r0=0.3, distribution=distribution)
        assert lobes.evaluate(n, n, lobe)[0] == pytest.approx(0.3 / (4 * np.pi * 0.02))
        across = lobe.model_copy(update={"side": "transmission"})
        assert lobes.evaluate((0.0, 0.0, -1.0), n, across)[0] == pytest.approx(0.7 / (4 * np.pi * 0.02))
        assert lobes.evaluate(n, n, across)[0] == 0


def test_brushed_along_t_is_sharp_along_t():
    """mx is the slope along t: where it is small, the lobe falls faster in the t-n plane than in the b-n plane."""
    lobe, n = Lobe(mx=0.05, my=0.3), (0.0, 0.0, 1.0)
    along, across = (direction(0.3, phi) for phi in (0.0, np.pi / 2))
    assert lobes.evaluate(tuple(along), n, lobe)[0] < 0.1 * lobes.evaluate(tuple(across), n, lobe)[0]


def test_a_retro_lobe_by_hand():
    """Towards the light f = k r0 / (4 pi mx my) at the normal and, with F = 1, (cos)^(-1 - 2 alpha) times it beside."""
    lobe = Lobe(retro=True, mx=0.01, my=0.02, r0=1.0, k=0.5, alpha=-1.5)
    peak = 0.5 / (4 * np.pi * 0.0002)
    for theta in (0.0, 0.5, 1.2):
        w = components(direction(theta, 0.7))
        assert lobes.evaluate(w, w, lobe)[0] == pytest.approx(peak * np.cos(theta) ** 2)
    beside = components(direction(0.5, 0.7 + np.pi))
    assert lobes.evaluate(beside, components(direction(0.5, 0.7)), lobe)[0] < 1e-9 * peak


def test_a_retro_lobe_is_the_mirrored_one_of_the_image_of_the_light():
    wi, wo = pairs()
    for name in RETRO:
        lobe = LOBES[f"retro-{name}"]
        mirrored = lobe.model_copy(update={"retro": False})
        for function in (lobes.evaluate, lobes.pdf):
            expected = function(components(wi * (-1, -1, 1)), components(wo), mirrored)
            np.testing.assert_array_equal(function(components(wi), components(wo), lobe), expected)


def test_two_sided():
    """A pair mirrored at the sheet has the same f."""
    wi, wo = pairs()
    flip = np.array([1, 1, -1])
    for lobe in LOBES.values():
        above = lobes.evaluate(components(wi), components(wo), lobe)
        below = lobes.evaluate(components(wi * flip), components(wo * flip), lobe)
        np.testing.assert_array_equal(above, below)


def test_density_of_half_vectors_integrates_to_one():
    """The projected microfacet area, integral of D h_z, is 1 for both distributions."""
    z = (np.arange(4000) + 0.5) / 4000
    phi = (np.arange(400) + 0.5) / 400 * 2 * np.pi
    h = direction(np.arccos(z)[:, None], phi[None, :])
    for distribution in ("beckmann", "ggx"):
        d = lobes.distribution(components(h), Lobe(mx=0.3, my=0.5, distribution=distribution))
        assert (d * h[..., 2]).mean() * 2 * np.pi == pytest.approx(1, abs=1e-3)


def test_components_agree_with_arrays():
    """Half vector and mirrored direction have a form in components, for the path tracer."""
    random = np.random.default_rng(0)
    wi, wo = directions.normalize(random.normal(size=(2, 100, 3)))
    h = lobes.half_vector(components(wi), components(wo))
    np.testing.assert_allclose(np.stack(h, axis=-1), directions.half_vector(wi, wo), atol=1e-15)
    mirrored = directions.reflect(wo, directions.half_vector(wi, wo))
    np.testing.assert_allclose(np.stack(lobes.reflect(components(wo), h), axis=-1), mirrored, atol=1e-14)
