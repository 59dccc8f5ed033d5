"""The z-test sees a difference that noise does not explain, and none where noise explains it."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tools.z_test import assert_same_image, mean_and_variance


def passes(seed, mean):
    return mean + np.random.default_rng(seed).normal(0, 0.1, (64, 16, 16, 3))


def test_same_image_passes_and_one_wrong_pixel_does_not():
    mean = np.linspace(0.1, 1, 16)[:, None, None] * np.ones((16, 16, 3))
    reference, reference_variance = mean_and_variance(passes(0, mean))
    image, variance = mean_and_variance(passes(1, mean))
    assert_same_image(image, variance, reference, reference_variance)
    image[3, 4, 1] += 0.15
    with pytest.raises(AssertionError, match=r"1 of 768 values differ; worst at \(3, 4, 1\)"):
        assert_same_image(image, variance, reference, reference_variance)


def test_nan_is_a_failure():
    black = np.zeros((2, 2, 3))
    with pytest.raises(AssertionError, match="not finite"):
        assert_same_image(black * np.nan, black, black, black)
