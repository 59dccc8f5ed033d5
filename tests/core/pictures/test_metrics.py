"""Colour and image metrics against values computed by hand or by another library."""

from __future__ import annotations

import numpy as np
import pytest
from colour import XYZ_to_Lab, XYZ_to_xy
from hypothesis import given
from hypothesis import strategies as st

from lambent.core.light import colour
from lambent.core.pictures import metrics


def test_red_in_lab() -> None:
    """Red of sRGB is L*a*b* (53.24, 80.09, 67.20)."""
    np.testing.assert_allclose(colour.rgb_to_lab(np.array([1.0, 0, 0])), [53.24, 80.09, 67.20], atol=0.03)


unit = st.floats(0, 1)


@given(st.tuples(unit, unit, unit))
def test_round_trips(rgb: tuple[float, float, float]) -> None:
    value = np.array(rgb)
    np.testing.assert_allclose(colour.xyz_to_rgb(colour.rgb_to_xyz(value)), value, atol=1e-9)
    np.testing.assert_allclose(colour.srgb_decode(colour.srgb_encode(value)), value, atol=1e-6)


@given(st.tuples(unit, unit, unit))
def test_lab_is_that_of_colour_science(rgb: tuple[float, float, float]) -> None:
    xyz, white = colour.rgb_to_xyz(np.array(rgb)), XYZ_to_xy(colour.WHITE_XYZ)
    np.testing.assert_allclose(colour.rgb_to_lab(np.array(rgb)), XYZ_to_Lab(xyz, white), atol=1e-9)


def test_psnr_by_hand() -> None:
    """A difference of .1 everywhere is 20 dB."""
    a = np.full((4, 4, 3), 0.5)
    assert metrics.psnr(a, a + 0.1) == pytest.approx(20)
    assert metrics.psnr(a, a) == float("inf")
    assert metrics.psnr(a * 100, a * 100 + 10, peak=100) == pytest.approx(20)


def test_rmse_by_hand() -> None:
    a = np.zeros((2, 2, 3))
    b = a.copy()
    b[0, 0] = [2, 0, 4]
    np.testing.assert_allclose(metrics.rmse_rgb(a, b), [1, 0, 2])
    white = np.ones((2, 2, 3))
    np.testing.assert_allclose(metrics.rmse_lab(a, white), [100, 0, 0], atol=1e-9)


def test_tile_means_with_a_border() -> None:
    error = np.zeros((20, 33))
    error[16:, 32:] = 1
    means = metrics.tile_means(error)
    np.testing.assert_allclose(means, [[0, 0, 0], [0, 0, 1]])


def test_a_hole_hides_in_the_mean_and_not_in_the_worst_tile() -> None:
    picture = np.full((256, 256, 3), 0.7)
    hole = picture.copy()
    hole[100:110, 100:110] = 0
    result = metrics.flip(picture, hole)
    assert result.mean == pytest.approx(0.002, abs=0.001)
    assert result.worst_tile > 0.4
    assert result.worst_tile_at == (96, 96)
    assert result.picture.shape == (256, 256, 3)


def test_flip_of_equal_pictures_is_zero_even_for_one_pixel() -> None:
    for shape in [(1, 1, 3), (40, 17, 3)]:
        picture = np.random.default_rng(1).random(shape)
        assert metrics.flip(picture, picture).mean == 0


def test_display_pair_brings_the_reference_to_the_mean() -> None:
    radiance = np.random.default_rng(2).exponential(40, (32, 32, 3))
    reference, test = metrics.display_pair(radiance, radiance * 2)
    assert reference.mean() == pytest.approx(0.3, abs=1e-6)
    assert test.mean() > reference.mean()
    assert reference.max() <= 1


@pytest.mark.parametrize("share", [0.01, 0.1, 0.4])
def test_little_light_before_black_is_not_clipped(share: float) -> None:
    """Where too few values are lit for the mean, they get a mean of 2/3, and differences stay visible."""
    radiance = np.zeros((40, 50, 3))
    radiance.reshape(-1, 3)[: round(2000 * share)] = np.random.default_rng(3).uniform(1, 4, (round(2000 * share), 3))
    reference, test = metrics.display_pair(radiance, radiance * 0.8)
    assert reference[reference > 0].mean() == pytest.approx(2 / 3, abs=1e-6)
    assert (test < reference)[radiance > 0].mean() > 0.9
