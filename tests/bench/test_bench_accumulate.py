"""Accumulated frames: the error falls at least as fast as their number grows, and towards the truth."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lambent.bench import accumulate
from lambent.scenes.environments import dusk

pytestmark = pytest.mark.usefixtures("adapter")


def test_frames_add_up_without_bias() -> None:
    lobes, frames = accumulate.LOBES[:1], (1, 4, 16, 60)
    effort = replace(accumulate.QUICK, truth_spp=4096, frames=frames, lobes=lobes, environments={"dusk": dusk})
    report = accumulate.run(effort)
    assert [row["samples"] for row in report["rows"]] == [8 * n for n in frames]
    assert all(slope < -1 for slope in report["summary"]["slope"].values())
    assert all(abs(row["bias_z"]) < 4 for row in report["rows"])
    assert all(psnr > 40 for psnr in report["summary"]["psnr"].values())


def test_the_slope_of_independent_samples_is_minus_one() -> None:
    rows = [{"frames": n, "mse": 0.3 / n} for n in (1, 2, 4, 64)]
    assert accumulate.slope_of(rows) == pytest.approx(-1)
