"""One frame in motion beside denoised path tracing: times of one clock, errors to one truth."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lambent.bake.bake import bake
from lambent.bake.quality import quality_named
from lambent.bench import equal_time
from lambent.scenes import load_scene

pytestmark = pytest.mark.usefixtures("adapter")


def test_rows_name_the_rival_of_equal_time(tmp_path):
    coarse = quality_named("preview").changed("coarse", geometry={"texels": 64}, environment={"texels": 32})
    bake(load_scene("builtin:box"), tmp_path / "box.store", quality=coarse)
    effort = replace(equal_time.QUICK, width=96, height=64, truth_spp=32, runs=1, spps=(1, 64))
    report = equal_time.run(effort, inputs=[tmp_path / "box.store"])
    frame, one, many = report["rows"]
    assert (frame["method"], one["method"], many["method"]) == ("frame", "path 1 spp", "path 64 spp")
    assert sum(row["equal"] for row in report["rows"]) == 1 and not frame["equal"]
    assert many["flip"] < one["flip"] and many["psnr"] > one["psnr"]
    assert 0 < frame["flip"] < 0.3 and frame["flip_worst_tile"] >= frame["flip"]
    assert report["summary"]["flip_of_path_over_frame"].keys() == {"box.store"}
