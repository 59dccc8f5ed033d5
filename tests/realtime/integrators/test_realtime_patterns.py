"""Where samples lie: masses, symmetry, no jumps."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.special import erfinv

from lambent.materials.document import Lobe
from lambent.materials.lobes import slope_radius
from lambent.materials.slope_curve import NODES_RHO
from lambent.realtime.integrators import patterns
from tests.materials.test_curve_lobes import SHAPES

NS = (3, 5, 7, 9, 11, 13, 15, 17, 19, 40)


@pytest.mark.parametrize("n", range(1, patterns.N_MAX + 1))
@pytest.mark.parametrize("is_fitted", [False, True])
def test_ring_counts_add_up(n: int, is_fitted: bool) -> None:
    counts = patterns.ring_counts(n, is_fitted)
    assert sum(counts) == n
    assert min(counts) >= 1


BECKMANN, GGX = (Lobe(mx=1.0, my=1.0, distribution=name) for name in ("beckmann", "ggx"))
GGX_CURVE = Lobe(  # the nodes of GGX, which a curve contains
    mx=1.0, my=1.0, distribution="curve", shape=tuple(((1 + NODES_RHO**2) ** -2.0).tolist())
)


@pytest.mark.parametrize("lobe", [BECKMANN, GGX])
@pytest.mark.parametrize("n", range(1, patterns.N_MAX + 1))
def test_half_of_each_rings_mass_lies_inside_its_radius(n: int, lobe: Lobe) -> None:
    pattern = patterns.ring_pattern(n, lobe)
    assert pattern.weight.mean() == pytest.approx(1)
    r = np.linalg.norm(pattern.slopes, axis=-1) / patterns.ring_stretch(n)
    inside = r**2 / (1 + r**2) if lobe is not BECKMANN else 1 - np.exp(-(r**2))
    before, first = 0.0, 0
    for count in patterns.ring_counts(n):
        mass = pattern.weight[first : first + count].sum() / n
        expected = 0.0 if count == 1 and before == 0 else before + mass / 2
        np.testing.assert_allclose(inside[first : first + count], expected, atol=1e-12)
        before, first = before + mass, first + count


@pytest.mark.parametrize("n", NS)
def test_rings_are_balanced(n: int) -> None:
    pattern = patterns.ring_pattern(n, BECKMANN)
    np.testing.assert_allclose(pattern.weight @ pattern.slopes, 0, atol=1e-12)
    covariance = (pattern.slopes.T * pattern.weight) @ pattern.slopes / n  # a Beckmann slope: m^2/2 per axis
    if n != 9:  # the inner ring of two is not round
        assert covariance[0, 0] == pytest.approx(covariance[1, 1])
    assert np.trace(covariance) == pytest.approx(1.0, abs=1.8 / np.sqrt(n) - 0.1)


@pytest.mark.parametrize("n", [11, 15, 19])
def test_a_line_of_weighted_samples_integrates_over_the_marginal(n: int) -> None:
    pattern = patterns.line_pattern(n, BECKMANN)
    x, w = pattern.slopes[:, 0], pattern.weight / n
    for frequency in (0.5, 1.0, 2.0, 3.0):  # the mean of cos(f x) over exp(-x^2) is exp(-f^2/4)
        weighted = abs(w @ np.cos(frequency * x) - np.exp(-(frequency**2) / 4))
        quantiles = erfinv((2 * np.arange(n) + 1) / n - 1)
        equal = abs(np.cos(frequency * quantiles).mean() - np.exp(-(frequency**2) / 4))
        assert weighted < 0.7 * equal  # at n = 19 a hundredth of it
    assert np.all(np.diff(x) > 0)
    np.testing.assert_allclose(x, -x[::-1], atol=1e-12)


@pytest.mark.parametrize("lobe", [GGX, GGX_CURVE])
def test_a_ggx_line_is_the_quantile_of_the_marginal(lobe: Lobe) -> None:
    """The marginal of GGX is (1 + x^2)^(-3/2) / 2, with the quantiles t / sqrt(1 - t^2)."""
    t = (2 * np.arange(7) + 1) / 7 - 1
    np.testing.assert_allclose(patterns.line_pattern(7, lobe).slopes[:, 0], t / np.sqrt(1 - t * t), atol=0.01)


def test_many_samples_of_a_curve_of_ggx_are_those_of_ggx() -> None:
    for n in (n for n in NS if n > patterns.FEW):
        np.testing.assert_allclose(patterns.rings_table(GGX_CURVE, n), patterns.rings_table(GGX, n), atol=2e-6)


def radial_error(pattern: patterns.Pattern, lobe: Lobe) -> float:
    """Largest difference between the shares of light within a radius: of a narrow lobe, and of what its samples see.

    Each sample sees a Gaussian around its direction; the light is drawn.
    """
    n, rng = len(pattern.weight), np.random.default_rng(3)
    deviation = np.sqrt(np.pi * pattern.factor / (4 * n))[:, None, None]
    seen = np.linalg.norm(pattern.slopes[:, None] + deviation * rng.normal(size=(n, 4000, 2)), axis=-1)
    mass = np.linspace(0.02, 0.99, 98)
    within = (seen[..., None] < slope_radius(mass, lobe)).mean(axis=1)
    return float(np.abs(pattern.weight @ within / n - mass).max())


CURVES = {  # and the largest errors of one, three and seven samples
    "beckmann": (np.exp(-(NODES_RHO**2).clip(0, 600)), 0.02, 0.02, 0.02),
    "core and haze": (np.exp(-(NODES_RHO**2)) + 0.004 * np.exp(-((NODES_RHO / 10) ** 2)), 0.25, 0.02, 0.02),
    "long tail": ((1 + NODES_RHO**2) ** -1.5, 0.21, 0.11, 0.055),
    "flat top": (np.exp(-(NODES_RHO**8).clip(0, 600)), 0.12, 0.06, 0.05),
}


@pytest.mark.parametrize("name", CURVES)
def test_few_samples_see_a_curve_from_its_core_to_its_tail(name: str) -> None:
    shape, *most = CURVES[name]
    lobe = Lobe(mx=0.002, my=0.002, alpha=0.5, distribution="curve", shape=tuple(np.maximum(shape, 1e-30).tolist()))
    errors = [radial_error(patterns.ring_pattern(n, lobe), lobe) for n in (1, 3, 7)]
    assert np.all(np.array(errors) < most)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("m, alpha, retro", [(0.001, 0.0, False), (0.3, 1.0, False), (4.0, -4.0, True)])
def test_any_curve_has_samples(name: str, m: float, alpha: float, retro: bool) -> None:
    """Also one whose light lies below the horizon, or that has none at its centre."""
    lobe = Lobe(mx=m, my=m, alpha=alpha, retro=retro, r0=1.0, distribution="curve", shape=SHAPES[name])
    for n in range(1, patterns.FEW + 1):
        rows = patterns.rings_table(lobe, n)
        assert np.isfinite(rows).all()
        assert rows[:, 3].min() >= 0
        assert rows[:, 3].mean() == pytest.approx(1, abs=1e-5)


@pytest.mark.long
@pytest.mark.parametrize("table", [patterns.rings_table, patterns.lobe_table])
@pytest.mark.parametrize("n", [5, 19])
def test_no_jump_while_the_roughness_slides(table, n: int) -> None:
    lobes = [Lobe(mx=0.1, my=float(0.1 * ratio)) for ratio in np.geomspace(0.1, 10, 4001)]
    for before, after in pairwise(lobes):
        rows = [table(lobe, n)[:, :2] / [lobe.mx, lobe.my] for lobe in (before, after)]
        if patterns.line_share(before, n) == 0 or patterns.line_share(after, n) == 0:
            rows = [r[np.lexsort(r.round(2).T)] for r in rows]  # which row a sample stands in does not matter
        assert np.abs(rows[1] - rows[0]).max() < 0.02
    assert patterns.line_share(lobes[0], n) == patterns.line_share(lobes[-1], n) == 1
    assert patterns.line_share(lobes[2000], n) == 0


@pytest.mark.parametrize("mx, my, long_axis", [(0.1, 0.01, 0), (0.01, 0.1, 1)])
@pytest.mark.parametrize("table", [patterns.rings_table, patterns.lobe_table])
def test_long_lobes_are_sampled_along_their_length(table, mx: float, my: float, long_axis: int) -> None:
    rows = table(Lobe(mx=mx, my=my), 9)
    assert np.abs(rows[:, 1 - long_axis]).max() < 1e-7
    np.testing.assert_allclose(np.sort(rows[:, long_axis]), -np.sort(rows[:, long_axis])[::-1], atol=1e-6)
    assert np.abs(rows[:, long_axis]).max() > 0.1


def test_the_thesis_ring_is_two_fifths_of_the_way_to_the_border() -> None:
    lobe = Lobe(mx=0.2, my=0.2)
    rows = patterns.lobe_table(lobe, 7)
    limit = np.arctan(0.2 * np.sqrt(-np.log(0.01)))  # 4.10
    angles = np.arctan(np.linalg.norm(rows[:, :2], axis=-1))
    np.testing.assert_allclose(angles, [0, *[0.4 * limit] * 6], rtol=1e-5)
    np.testing.assert_allclose(rows[1:, 3], np.exp(-((np.tan(0.4 * limit) / 0.2) ** 2)), rtol=1e-5)


def test_fis_filters_share_out_the_sphere_of_slopes() -> None:
    """c = 4 pi mx my/(n D): the solid angle of a sample is 1/(n pdf)."""
    lobe = Lobe(mx=0.3, my=0.1)
    rows = patterns.fis_table(lobe, 16)
    density = patterns.density(rows[:, :2] / [lobe.mx, lobe.my], lobe)
    np.testing.assert_allclose(4.0 ** rows[:, 2] * density, 4 * np.pi * 0.03 / 16, rtol=1e-5)
