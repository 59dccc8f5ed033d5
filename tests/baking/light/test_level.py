"""Denoised light keeps the level of its samples."""

from __future__ import annotations

import numpy as np

from lambent.baking.light.denoise import denoise_charts
from lambent.baking.light.detail import with_detail
from lambent.baking.light.level import with_level
from lambent.baking.light.sampling import variance_of
from lambent.core.arrays import Flags, Floats, Indices


def charts(size: int = 128) -> tuple[Flags, Indices]:
    """Two charts beside each other, with a gutter between and around them."""
    labels = np.full((size, 2 * size), -1)
    labels[2:-2, 2 : size - 2], labels[2:-2, size + 2 : -2] = 0, 1
    return labels >= 0, labels


def skewed(truth: Floats, rare: float, seed: int = 0) -> Floats:
    """Samples of mean `truth`: in a share `rare` of the texels one path found the light that is a fifth of all."""
    rng = np.random.default_rng(seed)
    factors = 0.8 * rng.gamma(10, 0.1, truth.shape[:2]) + 0.2 / rare * (rng.random(truth.shape[:2]) < rare)
    return truth * factors[..., None]


def test_skewed_noise_does_not_darken() -> None:
    known, labels = charts()
    truth = np.where(labels == 1, 4.0, 1.0)[..., None] * np.linspace(1, 2, 128)[:, None, None] * np.ones(3)
    noisy = skewed(truth, 0.004) * known[..., None]
    clean = denoise_charts(noisy, known, labels)
    kept = with_level(clean, noisy, known, labels)
    for chart in (0, 1):
        mine = labels == chart
        assert clean[mine].mean() < 0.97 * truth[mine].mean(), "the denoiser alone darkens"
        missing = [noisy[mine].mean() - light[mine].mean() for light in (clean, kept)]
        assert abs(missing[1]) < 0.5 * missing[0]
    assert np.array_equal(kept[~known], clean[~known]), "gutters"


def test_small_charts_stay_free_of_the_noise_of_their_samples() -> None:
    labels = np.full((64, 64), -1)
    for number in range(64):
        row, column = divmod(number, 8)
        labels[8 * row + 2 : 8 * row + 5, 8 * column + 2 : 8 * column + 5] = number
    known, truth = labels >= 0, np.ones((64, 64, 3))
    noisy = skewed(truth, 0.02) * known[..., None]
    clean = truth * 0.9
    kept = with_level(clean, noisy, known, labels)
    means = np.array([[light[labels == number].mean() for number in range(64)] for light in (noisy, kept)])
    assert np.sqrt(np.mean((means[1] - 1) ** 2)) < 0.6 * np.sqrt(np.mean((means[0] - 1) ** 2))


def test_a_chart_without_light_stays_black() -> None:
    known, labels = charts(32)
    light = np.where(labels == 1, 1.0, 0.0)[..., None] * np.ones(3)
    kept = with_level(light, light, known, labels)
    assert np.allclose(kept, light)


def test_light_that_one_texel_in_two_hundred_finds_is_not_lost() -> None:
    """The denoiser takes most of it for outliers, and texels that found nothing agree on darkness."""
    known, labels = charts()
    rng = np.random.default_rng(1)
    found = (rng.random((2, *labels.shape)) < 0.0025) * known
    halves = np.broadcast_to((400.0 * found)[..., None], (*found.shape, 3))
    noisy, clean = halves.mean(axis=0), denoise_charts(halves.mean(axis=0), known, labels, smooth=8)
    kept = with_detail(with_level(clean, noisy, known, labels), noisy, variance_of(halves), known, labels)
    assert clean[known].mean() < 0.4 * noisy[known].mean()
    assert 0.6 * noisy[known].mean() < kept[known].mean() < 1.05 * noisy[known].mean()
    assert np.median(kept[known]) > 0.035, "not in those texels alone"


def test_a_lucky_path_brightens_no_other_chart() -> None:
    known, labels = charts()
    truth = np.where(labels == 1, 1.0, 0.2)[..., None] * np.ones(3) * known[..., None]
    halves = np.stack([truth, truth])
    halves[0, 60, 60] = 0.5 * truth[labels == 0].sum() / 3  # half as much as all other light of its chart
    noisy = halves.mean(axis=0)
    kept = with_level(truth, noisy, known, labels, variance_of(halves))
    assert np.allclose(kept[labels == 1], 1.0, rtol=1e-3)
    assert 0.2 < kept[labels == 0].mean() < noisy[labels == 0].mean()
