"""The direct part of a light map from few samples."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baking.light.direct import cleaned_direct

LABELS = np.zeros((64, 64), int)
KNOWN = np.ones((64, 64), bool)
LIGHT = np.full((64, 64, 3), 2.0, np.float32)


@pytest.mark.parametrize(("mean", "shape"), [(1.2, 4.0), (2.0, 9.0)], ids=["a share", "all of it"])
def test_noise_is_averaged_and_the_share_kept(mean: float, shape: float) -> None:
    samples = np.random.default_rng(0).gamma(shape, mean / shape, (2, 64, 64, 3)).astype(np.float32)
    found = cleaned_direct(samples, KNOWN, LIGHT, LABELS).astype(float)
    assert found.mean() == pytest.approx(mean, rel=0.03) and found[8:-8, 8:-8].std() < 0.08


def test_one_bright_sample_leaves_no_spot() -> None:
    samples = np.full((2, 64, 64, 3), 0.2, np.float32)
    samples[0, 20, 20] = 500.0
    found = cleaned_direct(samples, KNOWN, LIGHT, LABELS).astype(float)
    assert found.max() < 0.4, "far below what its texel may count"
    assert found[50, 50, 0] == pytest.approx(0.2, rel=0.02)


def test_edges_of_shadows_stay() -> None:
    truth = np.where(np.arange(64)[:, None, None] < 32, 1.5, 0.05) * np.ones((2, 64, 64, 3))
    samples = (truth * np.random.default_rng(2).gamma(16.0, 1 / 16, truth.shape)).astype(np.float32)
    found = cleaned_direct(samples, KNOWN, LIGHT, LABELS).astype(float)
    assert found[35:, 8:-8].max() < 0.15 and found[:29, 8:-8].min() > 1.2
