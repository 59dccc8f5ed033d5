"""Detail kept beside denoised light: gaps that the filter fills, without the noise that it removes."""

from __future__ import annotations

import numpy as np

from lambent.baking.light.detail import with_detail

KNOWN, LABELS = np.ones((48, 48), bool), np.zeros((48, 48), int)


def sampled(light: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Means (H, W, 3) of two noisy halves with a heavy tail, and their variance as estimated from the halves."""
    rng = np.random.default_rng(seed)
    halves = light * rng.gamma(4, 0.25, (2, 48, 48))
    noisy = np.repeat(halves.mean(axis=0)[..., None], 3, axis=-1)
    return noisy, ((halves[0] - halves[1]) / 2) ** 2


def test_a_gap_that_the_filter_fills_is_dark_as_sampled() -> None:
    light, filtered = np.ones((48, 48)), np.ones((48, 48, 3))
    light[:, 20:25] = 0.02
    filtered[:, 20:25] = 0.3
    found = with_detail(filtered, *sampled(light, 1), KNOWN, LABELS)
    assert found[:, 21:24].mean() < 0.05 and np.abs(found[:, 30:] - 1).max() < 0.5


def test_a_gap_in_the_dark_is_found_beside_a_thousand_times_the_light() -> None:
    light, filtered, labels = np.ones((48, 48)), np.ones((48, 48, 3)), LABELS.copy()
    light[:, 20:25], filtered[:, 20:25] = 0.02, 0.3
    light[:24], filtered[:24] = 1e-3 * light[:24], 1e-3 * filtered[:24]
    labels[:24] = 1
    found = with_detail(filtered, *sampled(light, 1), KNOWN, labels)
    assert found[:24, 21:24].mean() < 0.05e-3 and found[24:, 21:24].mean() < 0.05


def test_what_the_filter_carries_from_daylight_into_a_dark_room_is_removed() -> None:
    light, filtered = np.full((48, 48), 100.0), np.full((48, 48, 3), 100.0)
    light[:, :24], filtered[:, :24] = 0.0, 0.02
    found = with_detail(filtered, *sampled(light, 1), KNOWN, LABELS)
    assert found[:, :22].max() < 0.002


def test_noise_stays_out() -> None:
    light = np.ones((48, 48))
    noisy, variance = sampled(light, 2)
    found = with_detail(np.ones((48, 48, 3)), noisy, variance, KNOWN, LABELS)
    assert np.std(noisy) > 0.3 and np.std(found) < 0.01


def test_darkness_and_texels_without_samples_are_left_alone() -> None:
    dark, none = np.zeros((48, 48, 3)), np.zeros((48, 48), bool)
    assert not with_detail(dark, dark, dark[..., 0], KNOWN, LABELS).any()
    noisy, variance = sampled(np.ones((48, 48)), 3)
    assert np.array_equal(with_detail(2 * noisy + 1, noisy, variance, none, LABELS), 2 * noisy + 1)


def test_rare_bright_paths_in_both_halves_of_a_texel_are_no_detail() -> None:
    """A path that adds three times the light arrives in one of fifty halves, so in both of one of 2,500 texels."""
    rng = np.random.default_rng(4)
    halves = np.ones((2, *KNOWN.shape))
    halves[rng.random(halves.shape) < 0.02] = 4.0
    halves[:, 24, 24] = 4.0, 4.2
    noisy = np.repeat(halves.mean(axis=0)[..., None], 3, axis=-1)
    found = with_detail(np.ones_like(noisy), noisy, ((halves[0] - halves[1]) / 2) ** 2, KNOWN, LABELS)
    assert noisy[24, 24, 0] > 4 and found.max() < 1.2


def test_a_line_one_texel_wide_is_detail() -> None:
    light, filtered = np.ones(KNOWN.shape), np.ones((*KNOWN.shape, 3))
    light[:, 24] = 0.02
    filtered[:, 23:26] = 0.6
    found = with_detail(filtered, np.repeat(light[..., None], 3, axis=-1), np.zeros(KNOWN.shape), KNOWN, LABELS)
    assert found[:, 24].max() < 0.03 and np.abs(found[:, 25] - 1).max() < 0.03
