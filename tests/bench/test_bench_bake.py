"""The bench `bake`: its rows hold together; no time is judged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from lambent.bench import bake as bench
from tests.bake.small_scenes import TINY, room_with_step


@pytest.mark.parametrize("artefact", ["light_map, photons", "probes, cached"])
def test_row_of_an_artefact(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, artefact: str) -> None:
    monkeypatch.setattr(bench, "RUNS", 1)
    quality = replace(TINY, photons_per_texel=16)
    case = next(case for case in bench.CASES if case.artefact == artefact)
    row = bench._row(room_with_step(), case, quality, tmp_path)
    assert row["texels"] > 0 and row["texels_per_s"] == pytest.approx(row["texels"] / row["seconds"])
    assert 0 < row["noise"] < 1
    assert (row["maps_per_s"] is None) == (case.kind == "light_map")
    assert row["resume_overhead_s"] is not None


def test_interrupted_bake_is_finished_all_the_same(tmp_path: Path) -> None:
    case = next(case for case in bench.CASES if case.light_map == "photons")
    scene, quality = room_with_step(), replace(TINY, photons_per_texel=16)
    ready = bench._ready(scene, case, quality, tmp_path / "ready")
    bench._interrupted(scene, case, quality, ready, tmp_path / "broken")
    _, whole = bench._timed(scene, case, quality, ready, tmp_path / "whole")
    from lambent.store.store import Store

    broken = Store.open(tmp_path / "broken")
    assert (broken.read("light_map/irradiance") == whole.read("light_map/irradiance")).all()
