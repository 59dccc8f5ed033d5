"""The direct part of a light map from few samples."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.bake.answering.direct import MOST, shared_by_charts

LABELS = np.zeros((40, 40), int)
KNOWN = np.ones((40, 40), bool)
LIGHT = np.full((40, 40, 3), 2.0, np.float32)


def test_noise_is_averaged_and_the_share_kept() -> None:
    samples = np.random.default_rng(0).gamma(4.0, 1.2 / 4, (40, 40, 3)).astype(np.float32)
    found = shared_by_charts(samples, KNOWN, LIGHT, LABELS).astype(float)
    assert found.mean() == pytest.approx(1.2, rel=0.02) and found[8:-8, 8:-8].std() < 0.08


def test_light_that_is_all_direct_stays_so() -> None:
    samples = np.random.default_rng(1).gamma(9.0, 2.0 / 9, (40, 40, 3)).astype(np.float32)
    assert shared_by_charts(samples, KNOWN, LIGHT, LABELS).mean() == pytest.approx(2.0, rel=0.03)


def test_one_bright_sample_leaves_no_spot() -> None:
    samples = np.full((40, 40, 3), 0.2, np.float32)
    samples[20, 20] = 500.0
    found = shared_by_charts(samples, KNOWN, LIGHT, LABELS).astype(float)
    assert found.max() < 0.2 + 0.05 * MOST * 2.0, "no more than a twentieth of the most that it may count"
    assert found[5, 5, 0] == pytest.approx(0.2, rel=2e-3)
