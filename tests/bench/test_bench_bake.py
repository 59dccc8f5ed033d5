"""The bench `bake`: its rows hold together; no time is judged."""

from __future__ import annotations

from pathlib import Path

import pytest

from lambent.bench import bake as bench
from lambent.store.store import Store
from tests.baking.small_scenes import TINY, room_with_step


@pytest.mark.long
def test_interrupted_bake_is_finished_all_the_same(tmp_path: Path) -> None:
    case = next(case for case in bench.CASES if case.light_map == "photons")
    bakes = bench.Bakes(room_with_step(), case, TINY.changed(light_map={"photons_per_texel": 16}), tmp_path)
    bakes.interrupted_s()
    _, whole = bakes.timed("whole")
    broken = Store.open(tmp_path / "broken")
    assert (broken.read("light_map/irradiance") == whole.read("light_map/irradiance")).all()
