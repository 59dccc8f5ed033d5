"""Pictures at rest and of edited rooms: errors fall with time, edits show, and what stays unedited is counted."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lambent.bench.measuring.reference import Reference
from lambent.bench.pictures import accumulate, edits
from lambent.store.store import Store
from lambent.traced.room import TracedRoom


@pytest.mark.long
def test_pictures_at_rest_come_below_path_tracing(coarse_box: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ticks = itertools.count()  # a second for each step
    monkeypatch.setattr(accumulate, "time", SimpleNamespace(process_time=lambda: float(next(ticks))))
    effort = replace(accumulate.QUICK, width=96, height=64, truth_spp=512, seconds=(1.0, 14.0))
    report = accumulate.run(effort, inputs=[coarse_box])
    first, last = report["rows"]
    assert first["ended"] < 16 and first["gathered"] == 0 and last["ended"] == 16 and last["gathered"] > 16
    assert (first["seconds"], last["seconds"], last["denoising_s"]) == (3.0, 14.0, 1.0)
    assert last["flip"] < first["flip"] and last["psnr"] > first["psnr"]
    assert last["flip"] < last["bar"], "two path traced pictures differ by more"
    assert last["bar"] > last["reference_flip"] > 0, "halves have more samples than quarters"
    assert report["summary"]["box.store"] == {key: last[key] for key in ("flip", "bar", "flip_worst_tile")}


@pytest.mark.long
def test_edits_of_all_kinds_show(coarse_box: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    effort = replace(edits.QUICK, width=96, height=64, samples=32, truth_spp=256)
    report = edits.run(effort, inputs=[coarse_box])
    baked, *edited = report["rows"]
    assert baked["edit"] == "as baked" and baked["unedited_flip"] == pytest.approx(baked["flip"], rel=0.05)
    colour, look, lamp, curve = edited
    assert colour["edit"].endswith("blue") and " as " in look["edit"] and lamp["edit"] == "lamp warm"
    assert curve["edit"].endswith("diffuse pulled")
    for row in edited:
        assert row["flip"] < row["unedited_flip"] and row["left_unedited"] == 0, row
        assert row["flip"] < 2 * baked["flip"] and row["relative_error"] < 0.1, row
    set_materials = TracedRoom.set_materials
    monkeypatch.setattr(
        TracedRoom,
        "set_materials",
        lambda room, *states: set_materials(room, *(states if room._light is None else ({}, {}))),
    )
    stays = list(edits.rows_of(Store.open(coarse_box), replace(effort, edits=1)))[1]
    assert stays["flip"] > colour["flip"] and stays["left_unedited"] > 0.05


def test_errors_count_where_few_pixels_are_compared() -> None:
    radiance = np.random.default_rng(1).uniform(0.5, 2, (48, 64, 3))
    shown = np.zeros((48, 64), bool)
    shown[20:26, 30:40] = True
    reference = Reference.of(radiance, shown)
    errors = reference.errors(radiance * [0.7, 1.0, 1.3])
    assert errors["flip_shown"] > 0.05 and errors["psnr"] < 30
    assert reference.errors(radiance)["flip"] == 0
