"""Frames in motion and traced pictures beside denoised path tracing: times of one clock, errors to one truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.bench.pictures import equal_time
from lambent.bench.registry import run_bench
from lambent.core.errors import UserError
from lambent.core.pictures.images import write_image
from lambent.render import Settings, images
from lambent.store.contract import scene_record
from lambent.store.store import Store

pytestmark = pytest.mark.usefixtures("adapter")


@pytest.mark.long
def test_rows_name_the_rival_of_equal_time(coarse_box):
    effort = replace(equal_time.QUICK, width=96, height=64, truth_spp=32, runs=1, samples=(1, 64))
    report = equal_time.run(effort, inputs=[coarse_box])
    frame, first, traced, one, many = report["rows"]
    assert [row["method"] for row in report["rows"]] == ["frame", "traced 1", "traced 64", "path 1 spp", "path 64 spp"]
    assert [row["equal"] for row in (one, many)].count(True) == 1
    assert not any(row["equal"] for row in (frame, first, traced))
    assert many["flip"] < one["flip"] and many["psnr"] > one["psnr"]
    assert traced["flip"] < first["flip"] < one["flip"], "baked light has less noise"
    assert first["seconds"] < traced["seconds"]
    assert 0 < frame["flip"] < 0.3 and frame["flip_worst_tile"] >= frame["flip"]
    assert report["summary"]["flip_of_path_over_frame"].keys() == {"box.store"}
    assert report["summary"]["equal_error"]["box.store"]["flip"] == max(equal_time.COMPARED, many["flip"])


def test_times_of_equal_error_are_interpolated():
    rows = [{"flip": flip, "seconds": seconds} for flip, seconds in ((0.1, 1.0), (0.05, 4.0), (0.04, 16.0))]
    assert equal_time.seconds_to(0.075, rows) == pytest.approx(2.0)
    assert equal_time.seconds_to(0.05, rows) == pytest.approx(4.0)
    assert equal_time.seconds_to(0.2, rows) == 1.0
    assert equal_time.seconds_to(0.03, rows) is None
    made = [
        {"scene": "room", "method": method, "flip": flip, "seconds": seconds, "equal": method == "path 4 spp"}
        for method, flip, seconds in (
            ("frame", 0.1, 1.0), ("traced 1", 0.09, 1.0), ("traced 4", 0.05, 2.0),
            ("path 1 spp", 0.12, 2.0), ("path 4 spp", 0.07, 8.0),
        )
    ]  # fmt: skip
    equal = equal_time.summary(made)["equal_error"]["room"]
    assert equal == {"flip": 0.07, "traced": pytest.approx(2**0.5, abs=1e-3), "path": 8.0, "ratio": 0.177}


@pytest.mark.long
def test_finished_references_are_the_truth_of_rows_of_their_size(coarse_box, tmp_path):
    effort = replace(equal_time.QUICK, width=96, height=64, runs=1, samples=(1,))
    files = []
    camera = scene_record(Store.open(coarse_box)).cameras[0]
    for seed in (1, 2):
        traced = images(Store.open(coarse_box), Settings(80, 48, "path", samples=64, seed=seed))
        files.append(tmp_path / f"{seed}.exr")
        write_image(files[-1], traced.radiance(camera))
    both = equal_time.run(effort, inputs=[coarse_box], reference=files)["rows"]
    alone = equal_time.run(effort, inputs=[coarse_box], reference=files[:1])["rows"]
    traced_here = equal_time.run(replace(effort, width=80, height=48, truth_spp=128), inputs=[coarse_box])["rows"]
    assert both[0]["reference_flip"] > 0 and alone[0]["reference_flip"] is None
    assert both[0]["flip"] == pytest.approx(traced_here[0]["flip"], rel=0.15)
    assert both[0]["flip"] != alone[0]["flip"]


@pytest.mark.long
def test_references_that_cannot_be_used_are_named(coarse_box, tmp_path):
    for name, shape in (("small", (4, 6, 3)), ("large", (8, 6, 3)), ("shown", (4, 6, 3))):
        write_image(tmp_path / (name + (".png" if name == "shown" else ".exr")), np.ones(shape, np.float32))
    small, large, shown = (tmp_path / name for name in ("small.exr", "large.exr", "shown.png"))
    with pytest.raises(UserError, match=r"large.exr: references differ in size; found 6x8; expected 6x4"):
        run_bench("equal-time", "quick", inputs=[coarse_box], reference=[small, large])
    with pytest.raises(UserError, match=r"shown.png: a reference must hold radiance; expected .exr or .hdr"):
        run_bench("equal-time", "quick", inputs=[coarse_box], reference=[shown])
    with pytest.raises(UserError, match=r"--reference: a reference belongs to one store; found 0 inputs"):
        run_bench("equal-time", "quick", reference=[small])
    with pytest.raises(UserError, match=r"--reference: this bench takes no reference; found flicker"):
        run_bench("flicker", "quick", inputs=[coarse_box], reference=[small])
