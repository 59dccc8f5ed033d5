"""One lobe: sampler, density and value agree over the whole range of parameters."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.geometry import directions
from lambent.core.geometry.directions import direction
from lambent.materials import lobes
from lambent.materials.bsdf import MaterialBSDF, components
from lambent.materials.checking.check import RECIPROCITY_LIMIT, reciprocity_error
from lambent.materials.document import Lobe, Material
from tests.tools.chi_square import assert_sampler, sampler_test

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
def test_sampler_follows_its_density(name, theta_deg, tmp_path):
    assert_sampler(MaterialBSDF(Material(lobes=(LOBES[name],))), theta_deg, 30.0, tmp_path)


@pytest.mark.parametrize("name", LOBES)
def test_reciprocal(name):
    assert reciprocity_error(MaterialBSDF(Material(lobes=(LOBES[name],)))) < RECIPROCITY_LIMIT


def test_a_pdf_wrong_by_two_per_cent_is_noticed_and_explained(tmp_path):
    """The right pdf passes; 2 % too high fails, and an image shows it."""
    right = MaterialBSDF(Material(lobes=(Lobe(mx=0.2, my=0.2),)))

    class TooHigh(MaterialBSDF):
        def pdf(self, wi, wo):
            return 1.02 * super().pdf(wi, wo)

    assert sampler_test(right, 40, 0).p_value > 1e-3
    with pytest.raises(AssertionError, match="do not follow the density"):
        assert_sampler(TooHigh(right.material), 40, 0, tmp_path)
    assert (tmp_path / "chi_square.png").stat().st_size > 10_000


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
