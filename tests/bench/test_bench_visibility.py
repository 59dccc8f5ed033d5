"""The bench `visibility`: its figures are those that one counts oneself, its scenes are whole."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from lambent.bench import visibility as bench
from lambent.bench.scenes.visibility_scenes import CASES

SIZE, LIGHTS = 33, 50


@pytest.mark.long
def test_rows_are_counted_by_hand(mi: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rays are counted where they are traced; the truth is asked of Mitsuba's scene itself, ray by ray."""
    from lambent.baking.tracing.scene_builder import SceneBuilder
    from lambent.baking.transport.view_points import view_points
    from lambent.published import visibility as predicted
    from lambent.published.visibility import ShadowRays

    rays: list[int] = []
    results: list[tuple[predicted.Variant, predicted.Predicted, int]] = []
    real, asked, places = predicted.predicted_visibility, ShadowRays.blocked, ShadowRays.blockers

    def counting(way: Any) -> Any:
        def trace(self: ShadowRays, point: Any, light: Any) -> Any:
            rays.append(len(point))
            return way(self, point, light)

        return trace

    def kept(*arguments: Any) -> predicted.Predicted:
        rays.clear()
        found = real(*arguments)
        results.append((arguments[-1], found, sum(rays)))
        return found

    monkeypatch.setattr(ShadowRays, "blocked", counting(asked))
    monkeypatch.setattr(ShadowRays, "blockers", counting(places))
    monkeypatch.setattr(predicted, "predicted_visibility", kept)
    monkeypatch.setattr(bench, "CASES", {"shapes": CASES["shapes"]})
    report = bench.run(bench.Effort(SIZE, (LIGHTS,), runs=1))

    case = CASES["shapes"]
    builder, w = SceneBuilder(case.scene()), case.lights(LIGHTS).centres
    scene = builder.build()
    points = view_points(builder, scene, case.camera, SIZE, SIZE)
    towards = points.flat * np.sign((points.flat * points.n).sum(axis=1))[:, None]
    facing = towards.astype(float) @ w.T > 0
    start = (points.p + 1e-4 * towards).T[:, :, None] + 0 * w.T[:, None, :]
    along = 0 * start + w.T[:, None, :]
    ray = mi.Ray3f(
        *(kind(*(np.float32(c.ravel()) for c in v)) for kind, v in ((mi.Point3f, start), (mi.Vector3f, along)))
    )
    lit = ~np.array(scene.ray_test(ray)).reshape(facing.shape)
    assert 0.1 < (facing & ~lit).sum() / facing.sum() < 0.6

    rows = {row["variant"]: row for row in report["rows"]}
    assert len(results) == len(predicted.VARIANTS) and len(rows) == 1 + len(results)
    (exact,) = (row for name, row in rows.items() if name not in predicted.VARIANTS)
    assert (exact["traced_percent"], exact["wrong_percent"]) == (100, 0)
    most_wrong = 0.0
    for variant, found, traced in results:
        row = rows[next(name for name, which in predicted.VARIANTS.items() if which is variant)]
        assert (row["scene"], row["lights"]) == ("shapes", len(w))
        assert row["traced_percent"] == pytest.approx(100 * traced / facing.sum(), rel=1e-3)
        wrong = 100 * (facing & (found.seen != lit)).sum() / facing.sum()
        assert row["wrong_percent"] == pytest.approx(wrong, abs=0.02)
        assert 0 < row["ray_seconds"] < row["seconds"]
        most_wrong = max(most_wrong, wrong)
    assert most_wrong > 0.1, "errors are large enough to tell a wrong denominator"
    fastest = min(report["rows"], key=lambda row: row["seconds"])
    assert report["summary"]["fastest"] == [{key: fastest[key] for key in ("scene", "lights", "variant")}]
    assert (report["summary"]["size"], report["summary"]["runs"]) == (SIZE, 1)
    json.dumps(report)
