"""Accumulated frames: the error falls at least as fast as their number grows, and towards the truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm, t

from lambent.bench import accumulate
from lambent.scenes.environments import dusk

pytestmark = pytest.mark.usefixtures("adapter")


def test_frames_add_up_without_bias() -> None:
    lobes, frames = accumulate.LOBES[:1], (1, 4, 16, 60)
    report = accumulate.run(
        replace(accumulate.QUICK, truth_spp=4096, frames=frames, lobes=lobes, environments={"dusk": dusk})
    )
    assert {row["case"] for row in report["rows"]} == {"dusk", "planar"}
    assert all(slope < -1 for slope in report["summary"]["slope"].values())
    assert all(abs(row["bias_z"]) < 4 for row in report["rows"])
    assert all(psnr > 40 for psnr in report["summary"]["psnr_promised"].values())


def test_the_slope_of_independent_samples_is_minus_one() -> None:
    rows = [{"frames": n, "mse": 0.3 / n} for n in (1, 2, 4, 64)]
    assert accumulate.slope_of(rows) == pytest.approx(-1)


def test_two_sets_of_replicas_agree_where_they_are_of_one_truth() -> None:
    """Normal noise about one image: z has the deviation 1; 1 % more light in one set is found."""
    rng = np.random.default_rng(2)
    shown = np.ones((48, 64), bool)
    one, other = (1 + 0.3 * rng.normal(size=(n, 48, 64, 3)) for n in (24, 16))
    same, brighter = (accumulate.agreement(a, other, shown) for a in (one, 1.01 * one))
    assert same["z_rms"] == pytest.approx(1, abs=0.05) and same["z_blocks_rms"] == pytest.approx(1, abs=0.3)
    assert abs(same["z_mean"]) < 0.1 and abs(same["z_whole"]) < 4 and same["z_above_3"] < 0.006
    assert abs(same["difference_percent"]) < 0.4
    assert brighter["difference_percent"] - same["difference_percent"] == pytest.approx(1, abs=0.02)
    assert brighter["z_whole"] > 5


def test_z_by_hand() -> None:
    """Means 1 apart, variances 2 and 2 over 2 replicas each: t = 1/sqrt(2) with 2 degrees of freedom."""
    a, b = np.array([[1.0], [3.0]]), np.array([[0.0], [2.0]])
    expected = norm.isf(t.sf(1 / np.sqrt(2), 2))
    assert accumulate.z_of(a, b) == pytest.approx([expected]) and accumulate.z_of(b, a) == pytest.approx([-expected])


def test_blocks_are_squares_of_pixels() -> None:
    shown = np.ones((2 * accumulate.BLOCK, 2 * accumulate.BLOCK), bool)
    image = np.kron(np.array([[1.0, 2.0], [3.0, 4.0]]), np.ones((accumulate.BLOCK, accumulate.BLOCK)))
    assert accumulate.block_means(image[shown][None], shown).tolist() == [[1, 2, 3, 4]]
