from __future__ import annotations

import json

import pytest

from lambent.bench.fit import run
from lambent.core.progress import silent
from lambent.materials.measured.gonio_text import write_gonio
from lambent.materials.measured.synthetic import synthesise
from tests.materials.fitting.known_answers import FEW, PAINT


@pytest.mark.slow
def test_known_answers_are_found():
    report = run(True, [], silent)
    assert {(row["file"], row["method"]) for row in report["rows"]} == {
        (file, method) for file in ("alanod", "foil") for method in ("grid", "gradient")
    }
    assert report["summary"]["largest_deviation"] < 0.25
    json.dumps(report)


def test_callers_file_is_fitted(tmp_path):
    path = tmp_path / "paint.txt"
    write_gonio(path, synthesise(PAINT, FEW))
    report = run(True, [path], silent)
    assert [row["file"] for row in report["rows"]] == ["paint.txt"] * 2
    for row in report["rows"]:
        assert row["albedo_model"] == pytest.approx(row["albedo_measured"], rel=0.02)
        assert row["error"]["cuberoot"] < 0.1 * row["error_lambertian"]["cuberoot"]
