"""The bench `bake`: its rows hold together; no time is judged."""

from __future__ import annotations

from pathlib import Path

import pytest

from lambent.bench import bake as bench
from lambent.store.store import Store
from tests.bake.small_scenes import TINY, room_with_step


@pytest.mark.parametrize("artefact", ["light_map, photons", "probes, cached"])
def test_row_of_an_artefact(tmp_path: Path, artefact: str) -> None:
    effort = bench.Effort(TINY.changed(light_map={"photons_per_texel": 16}), runs=1)
    case = next(case for case in bench.CASES if case.artefact == artefact)
    row = bench.row_of(room_with_step(), case, effort, tmp_path)
    assert row["texels"] > 0 and row["texels_per_s"] == pytest.approx(row["texels"] / row["seconds"])
    assert 0 < row["noise"] < 1
    assert (row["maps_per_s"] is None) == (case.kind == "light_map")
    assert row["resume_overhead_s"] is not None


def test_interrupted_bake_is_finished_all_the_same(tmp_path: Path) -> None:
    case = next(case for case in bench.CASES if case.light_map == "photons")
    bakes = bench.Bakes(room_with_step(), case, TINY.changed(light_map={"photons_per_texel": 16}), tmp_path)
    bakes.interrupted_s()
    _, whole = bakes.timed("whole")
    broken = Store.open(tmp_path / "broken")
    assert (broken.read("light_map/irradiance") == whole.read("light_map/irradiance")).all()
