"""Every export ends with a verdict in words, by limits that stand in one place."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest

from lambent.materials.document import Lobe, Material
from lambent.materials.export import gltf
from lambent.materials.export.contract import LIGHT_LIMITS, LIMITS, RETRO_LIMITS, Cost, verdict_of, writers
from lambent.materials.measured.inspecting.metrics import METRICS
from tests.materials.export.export_materials import ALL

PERFECT = dict.fromkeys(METRICS, 0.0)


def test_each_metric_has_limits_and_each_limit_decides() -> None:
    assert set(LIMITS) == set(METRICS)
    assert verdict_of(PERFECT, {"reflection": 1.0}).word == "faithful"
    for name, (faithful, usable) in LIMITS.items():
        assert verdict_of(PERFECT | {name: faithful}, {}).word == "faithful"
        found = verdict_of(PERFECT | {name: 1.01 * faithful}, {})
        assert found.word == "approximate" and found.reason.startswith(name)
        found = verdict_of(PERFECT | {name: 1.01 * usable}, {})
        assert found.word == "unusable" and f"limit {usable:.0%}" in found.reason
    assert verdict_of(PERFECT | {"l1": float("nan")}, {}).word == "unusable"


def test_the_page_states_the_limits() -> None:
    page = (Path(__file__).parents[3] / "docs" / "exporting.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([^|]+) \| (?:within )?(\d+) %[^|]* \| (?:within )?(\d+) % \|$", page, re.MULTILINE)
    stated = {name.split(":")[0].strip(): (int(low) / 100, int(high) / 100) for name, low, high in rows}
    names = {"l1": "L1", "l2_ngan": "L2 (Ngan)", "cuberoot": "cube root", "log": "log"}
    assert stated == {names[name]: limits for name, limits in LIMITS.items()} | {
        "reflected and transmitted light, each": LIGHT_LIMITS,
        "f back towards the light, where retro lobes were left out": RETRO_LIMITS,
    }


@pytest.mark.parametrize("side", ["reflection", "transmission"])
def test_light_that_is_lost_or_made_decides_too(side) -> None:
    faithful, usable = LIGHT_LIMITS
    for sign in (-1, 1):
        assert verdict_of(PERFECT, {side: 1 + sign * (faithful + 0.01)}).word == "approximate"
        found = verdict_of(PERFECT, {side: 1 + sign * (usable + 0.01)})
        assert found.word == "unusable" and "light" in found.reason


def test_no_comparison_is_no_praise() -> None:
    assert Cost().verdict.word == "not compared"


def test_different_lobes_in_one_are_unusable() -> None:
    """Three Beckmann lobes from mirror-like to matt: glTF has one, with other tails."""
    lobes = tuple(Lobe(k=0.3, mx=m, my=m, r0=0.9) for m in (0.01, 0.08, 0.5))
    cost = gltf.likeness(Material(name="three", lobes=lobes))[1]
    assert cost.verdict.word == "unusable" and "limit" in cost.verdict.reason
    assert gltf.likeness(ALL["-- paper"])[1].verdict.word == "faithful"


@pytest.mark.parametrize("name", writers())
def test_every_writer_compares_its_file(name: str, tmp_path: Path) -> None:
    """A Lambert surface, which every format holds."""
    writer = writers()[name]
    assert "material" in writer.TAKES and inspect.isfunction(writer.write)
    cost = writer.write(Material(name="matt", kd=0.5), tmp_path / f"a{writer.ENDINGS[0]}", lambda *_: None)
    assert cost.verdict.word == "faithful" and cost.light["reflection"] == pytest.approx(1, abs=0.05)
