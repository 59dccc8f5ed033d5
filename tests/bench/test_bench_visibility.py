from __future__ import annotations

import json

import numpy as np
import pytest

from lambent.bench import visibility
from lambent.bench.visibility import Effort, run
from lambent.bench.visibility_scenes import CASES

VARIANTS = {"TRUE", "SWB", "GWB", "GNB", "GWU", "GNU", "OPT"}


def test_rows_of_every_variant(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(visibility, "CASES", {"shapes": CASES["shapes"]})
    report = run(Effort(33, (50,), runs=1))
    assert {row["variant"] for row in report["rows"]} == VARIANTS
    for row in report["rows"]:
        exact = row["variant"] == "TRUE"
        assert 40 < row["lights"] <= 50
        assert (row["traced_percent"] == 100) == exact and row["traced_percent"] > 10
        assert (row["wrong_percent"] == 0) if exact else row["wrong_percent"] < 3
        assert 0 < row["seconds_min"] <= row["seconds"] <= row["seconds_max"]
    (fastest,) = report["summary"]["fastest"]
    assert fastest["scene"] == "shapes" and fastest["variant"] in VARIANTS
    json.dumps(report)


@pytest.mark.parametrize("name", CASES)
def test_scenes_stand_on_their_floor(name: str) -> None:
    scene = CASES[name].scene()
    lowest = min(float(o.mesh.positions[:, 1].min()) for o in scene.objects[1:])
    assert lowest == pytest.approx(0, abs=0.06)
    for o in scene.objects:
        assert np.isfinite(o.mesh.positions).all()
        assert np.allclose(np.linalg.norm(o.mesh.normals, axis=1), 1, atol=1e-4)
    assert 190 < len(CASES[name].lights(200)) <= 200
