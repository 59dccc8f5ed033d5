"""Filling and denoising."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baking.light.denoise import denoise, denoise_charts, denoise_image, fill, layers_of


def test_gutters_take_what_is_next_to_them() -> None:
    known = np.zeros((20, 20), bool)
    known[5:10, 5:10] = True
    filled = fill(np.where(known[..., None], 3.0, 0.0) * np.ones(3), known, np.where(known, 0, -1))
    assert np.allclose(filled, 3)


def test_hidden_texels_take_from_their_own_chart() -> None:
    labels = np.zeros((8, 12), int)
    labels[:, 6:] = 1
    known = np.ones((8, 12), bool)
    known[:, 3:6] = False  # hidden part of chart 0, next to chart 1
    values = np.where(labels[..., None] == 0, 1.0, 9.0) * np.ones(3)
    assert np.allclose(fill(values, known, labels)[:, :6], 1)


def test_nothing_known_is_black() -> None:
    assert not fill(np.ones((4, 4, 3)), np.zeros((4, 4), bool), np.zeros((4, 4), int)).any()


def test_noise_falls_and_the_mean_stays() -> None:
    rng = np.random.default_rng(0)
    truth = np.linspace(1, 2, 128)[None, :, None] * np.ones((128, 1, 3))
    noisy = truth * rng.gamma(10, 0.1, truth.shape)
    clean = denoise(noisy)
    assert clean.shape == truth.shape
    assert np.sqrt(np.mean((clean - truth) ** 2)) < 0.15 * np.sqrt(np.mean((noisy - truth) ** 2))
    assert abs(clean.mean() / truth.mean() - 1) < 0.01
    assert np.abs(clean - truth).max() < 0.2, "borders included"


def test_darkness_stays_dark() -> None:
    assert not denoise(np.zeros((16, 16, 3))).any()


@pytest.mark.parametrize("contrast", [1, 100, 1000, 10000])
def test_a_dark_part_of_a_chart_keeps_its_light_and_its_grey(contrast: float) -> None:
    """A floor that passes from a dark room into a bright one; noise is equal in all channels."""
    rng = np.random.default_rng(1)
    truth = np.where(np.arange(128) < 64, 1.0, contrast)[None, :, None] * np.ones((128, 1, 3)) * 0.01
    found = (denoise(truth * rng.gamma(4, 1 / 4, (128, 128, 1))) / truth)[:, :56]
    assert np.sqrt(np.mean((found - 1) ** 2)) < 0.1 and found.mean() == pytest.approx(1, abs=0.05)
    assert (found.max(axis=-1) < 1.05 * found.min(axis=-1)).mean() > 0.93


def test_a_bright_chart_stays_out_of_a_dark_one_beside_it() -> None:
    labels = np.full((64, 64), -1)
    labels[:, :31], labels[:, 33:] = 3, 7
    known = labels >= 0
    rng = np.random.default_rng(0)
    noisy = np.where(labels == 7, 100.0, 1.0)[..., None] * rng.gamma(4, 1 / 4, (64, 64, 3)) * known[..., None]
    layers = layers_of(noisy, known, labels)
    assert {int(layers[0, 0]), int(layers[0, 63])} == {0, 1} and layers[0, 32] == -1
    clean, joined = denoise_charts(noisy, known, labels), denoise(fill(noisy, known, labels))
    assert clean[:, 30].mean() == pytest.approx(1, abs=0.1), joined[:, 30].mean()
    assert abs(joined[:, 30].mean() - 1) > 0.3, "in one layer the filter smears"
    assert clean[:, 33:36].mean() == pytest.approx(100, abs=10)
    assert not layers_of(np.where(known, 1.0, 0.0)[..., None] * np.ones(3), known, labels)[known].any()


def test_black_pictures_stay_black() -> None:
    albedo, normal = np.full((2, 32, 48, 3), 0.5, np.float32)
    assert not denoise_image(np.zeros((32, 48, 3), np.float32), albedo, normal).any()
