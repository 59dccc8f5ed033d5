from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from lambent.bench.gi_edit import CASES, QUICK, run
from lambent.bench.scenes.gi_edit_states import KINDS, WHITEST, flip_between, setting
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.albedo import albedo
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import same_quotients

SMALL = replace(QUICK, shrink=10, frames=2, edge=16, cases=CASES[-1:], series=((64, 1), (16, 8)))


@pytest.mark.long
def test_rows_of_a_scene_and_of_its_series() -> None:
    report = run(SMALL)
    row, *compared = report["rows"]
    assert (row["scene"], row["series"], row["size"], row["slots"]) == ("ring", "64,16", "40x40", 2)
    assert 0.5 * 1600 < row["points"] <= 1600 and row["samples"] == SMALL.samples
    assert 0 < row["first_seconds"] < row["bake_seconds"] and row["thesis_samples"] == 4000
    assert row["thesis_seconds"] == pytest.approx(4000 * row["points"] / row["samples_per_second"], abs=1)
    assert row["stored_mib"] >= 0 and row["memory_mib"] > 0 and 0 < row["share_not_zero"] < 1
    assert row["freeze_seconds"] > 0 and 0 < row["frame_ms"] <= row["frame_worst_ms"]
    assert 0 < row["flip"] < 0.3 and 0 < row["noise_flip"] < 0.3 and 0 < row["relmse"] < 1
    assert 0 < row["opened_flip"] < 0.3 and row["settings"] == 3
    assert all(row["flip_worst"] >= row[f"flip_{kind}"] > 0 for kind in KINDS)
    close, slow = row["rival_flip"] <= row["flip"] + 1e-4, isinstance(row["rival_seconds"], str)
    assert close or slow, "it came as close, or says how long it tried"
    assert [one["series"] for one in compared] == ["64,1", "16,8"]
    assert all(one["error_seconds"] > 0 and one["flip"] > 0 for one in compared)
    assert report["summary"]["best_series"]["ring"]["relmse"] in ("64,1", "16,8")
    json.dumps(report)


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_settings_can_be_shown_without_a_new_bake(kind: str) -> None:
    glossy = Material(kd=(0.7, 0.6, 0.5), lobes=(Lobe(mx=0.1, my=0.2, r0=0.6),))
    start = of_material(glossy)
    first, second = (setting(kind, glossy, np.random.default_rng(seed)) for seed in (1, 2))
    for made in (first, second):
        assert same_quotients(start, made)
        assert 0 < albedo(made, "reflection").max() <= (WHITEST + 1e-6 if kind == "bands" else 2)
    assert (first.terms, list(first.curves)) != (second.terms, list(second.curves)) or any(
        not np.array_equal(first.curves[name].values, second.curves[name].values) for name in first.curves
    )
    changed = any(not np.array_equal(first.curves[name].values, start.curves[name].values) for name in start.curves)
    assert changed == (kind != "colours")


def test_edges_of_objects_do_not_count_inside() -> None:
    rng = np.random.default_rng(0)
    reference = rng.uniform(0.2, 0.8, (24, 24, 3))
    shown = np.ones((24, 24), bool)
    shown[:, 11:13] = False
    image = reference.copy()
    image[:, 11:13] = 5.0
    assert flip_between(reference, image) > 0.05 and flip_between(reference, image, shown) == 0.0
