from __future__ import annotations

import json
from dataclasses import replace

import pytest

from lambent.bench.fit import METRICS, MODELS, QUICK, run
from lambent.bench.scenes.below_zero import SIZE
from lambent.bench.scenes.known_answers import KNOWN
from lambent.bench.scenes.retro_tapes import TAPES
from lambent.materials.measured.inspecting.synthetic import synthesise
from lambent.materials.measured.parts.gonio_text import write_gonio
from tests.materials.fitting.known_answers import FEW, PAINT

WARD = "paint = Aggregate(Lambertian(albedo = [.2, .2, .2]), NganWard(albedo = [.04, .03, .02], roughness = .15))\n"


@pytest.mark.long
def test_known_answers_are_found():
    report = run(replace(QUICK, known=(KNOWN["white foil"],), below_zero=False, tapes=()))
    names = [p["parameter"] for p in report["rows"][0]["parameters"]]
    assert names == ["kd", "ks", "mx", "my", "r0", "alpha", "kt (1 - r0)", "t_mx", "t_my", "t_alpha"]
    assert report["summary"]["largest_deviation"] < 0.05
    assert report["summary"]["l1_over_truth"] <= 1
    json.dumps(report)


@pytest.mark.long
def test_readings_below_zero_leave_the_albedo():
    report = run(replace(QUICK, known=(), tapes=()))
    assert {row["file"].split(", ")[1] for row in report["rows"]} == {"clean", "blue lowered", "noise"}
    for row in report["rows"]:
        assert (row["below_zero"] > 0.1 * row["tuples"]) == ("clean" not in row["file"])
        assert row["albedo_change"] < 0.025 and abs(row["dark_albedo_change"]) < 4 * SIZE
    assert report["summary"]["below_zero_albedo_change"] < 0.025
    json.dumps(report)


@pytest.mark.long
def test_callers_file_is_fitted_and_held_against_what_was_published(tmp_path):
    path, published = tmp_path / "paint.txt", tmp_path / "ward.fit"
    write_gonio(path, synthesise(PAINT, replace(FEW, step_deg=10.0, fine_deg=4.0)))
    published.write_text(WARD)
    report = run(QUICK, [path], against=[published])
    ours = [row for row in report["rows"] if row["method"] in ("grid", "gradient")]
    assert len(ours) <= len(METRICS) * (len(MODELS) + 1)
    for row in ours:
        assert row["albedo_model"] == pytest.approx(row["albedo_measured"], rel=0.05)
        assert row["share"] < 0.2
    assert report["summary"]["published_compared"] == report["summary"]["published_beaten"] == len(METRICS)
    assert report["summary"]["gradient_over_grid_error_max"] <= 1
    json.dumps(report)


@pytest.mark.long
def test_retro_reflectors_are_fitted_with_and_without_their_lobe():
    report = run(replace(QUICK, known=(), tapes=TAPES[:1], below_zero=False))
    without, with_it = report["rows"]
    assert with_it["share"] < 0.2 * without["share"]
    assert report["summary"] == {"retro_over_no_retro_max": with_it["share"] / without["share"]}
    assert with_it["albedo_model"] == pytest.approx(with_it["albedo_measured"], rel=0.1)
    json.dumps(report)
