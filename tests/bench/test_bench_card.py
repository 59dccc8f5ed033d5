"""Bench `card`: a run that dies keeps its rows, one without time leaves some out, and a failure costs one row."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from lambent.bench import card
from lambent.bench.card_rows import found, process, row, site
from lambent.bench.card_rows.baking import OWN
from lambent.core.errors import UserError

FRAMES = ("frames, curved", "frames, planar")
TINY = replace(card.QUICK, sizes=((32, 20),), ns=(3,), rounds=1)
RUN = """
import sys
from pathlib import Path
from lambent.bench import card
from tests.bench.test_bench_card import TINY, frames
card.found_rows = frames
card.run(TINY, Path(sys.argv[1]), lambda done, total, what: print(what, flush=True))
"""


def frames() -> dict[str, row.Row]:
    return {name: one for name, one in found.rows().items() if name in FRAMES}


@pytest.fixture
def two_rows(adapter: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(card, "found_rows", frames)


def test_rows_are_found_in_order_and_fit_into_the_budget() -> None:
    rows = found.rows()
    assert set(FRAMES) < set(rows) and next(iter(rows)) == "bake, CUDA"
    assert sum(one.limit_s for one in rows.values()) <= card.BUDGET_S
    assert len({one.turn for one in rows.values()}) == len(rows)


@pytest.mark.long
def test_a_run_that_is_killed_keeps_its_figures(two_rows: None, tmp_path: Path) -> None:
    file = tmp_path / "card.json"
    with subprocess.Popen([sys.executable, "-c", RUN, str(file)], stdout=subprocess.PIPE, text=True) as run:
        assert run.stdout is not None
        for line in run.stdout:
            if line.startswith(FRAMES[1]):  # the first row is done
                run.kill()
    before = json.loads(file.read_text())
    assert before["done"] == [FRAMES[0]]
    named: list[str] = []
    report = card.run(TINY, file, lambda done, total, what: named.append(what))
    assert [(one["row"], one["name"], one["reason"]) for one in report["rows"]] == [
        (name, "32x20, n = 3", None) for name in FRAMES
    ]
    assert report["rows"][0] == before["rows"][0], "it was not measured again"
    assert not [what for what in named if what.startswith(FRAMES[0])]
    assert report["summary"]["done"] == 2 and all(one["value"] > 0 for one in report["rows"])
    assert [path.name for path in tmp_path.iterdir()] == ["card.json"]
    with pytest.raises(UserError, match=r"card.json: effort: has rows of other conditions.*name another file with -o"):
        card.run(replace(TINY, rounds=2), file)


def test_rows_without_time_are_left_out(two_rows: None, tmp_path: Path) -> None:
    report = card.run(replace(TINY, budget_s=0.0), tmp_path / "none.json")
    assert [one["reason"] for one in report["rows"]] == ["left out: it may take 0 s, and -0 s are left"] * 2
    report = card.run(replace(TINY, budget_s=0.1), tmp_path / "few.json")  # no process starts within that time
    assert [one["reason"][:12] for one in report["rows"]] == ["stopped afte", "left out: it"]
    assert report["summary"]["done"] == 0


def test_published_figures_stand_beside(two_rows: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def measured(name: str, *_given: object) -> Iterator[dict[str, Any] | None]:
        yield None
        yield {"name": "1680x1050, n = 7", "value": 400.0, "unit": "frames/s", "device": "a card"}
        if name == FRAMES[1]:
            raise process.Failed("it broke")

    monkeypatch.setattr(card, "figures", measured)
    curved, planar, broken = card.run(TINY, tmp_path / "card.json")["rows"]
    assert (curved["value"], curved["published"], curved["on"]) == (400.0, "41", row.THESIS_M)
    assert (planar["published"], broken["value"], broken["reason"]) == ("33", None, "it broke")


@pytest.mark.parametrize("content", ["{}", '{"bench": "card", "made_with": 1}', "[1", '{"bench": "fit"}'])
def test_other_files_stay(two_rows: None, content: str, tmp_path: Path) -> None:
    file = tmp_path / "card.json"
    file.write_text(content)
    with pytest.raises(UserError, match=r"card\.json"):
        card.run(TINY, file)
    assert file.read_text() == content


@pytest.mark.long
def test_reasons_are_lines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(process.Failed, match="ended with code 1 KeyError: 'no such row'"):
        list(process.figures("no such row", row.Row(lambda effort, work: iter(()), 1, 0, OWN), TINY, tmp_path, 600))
    monkeypatch.setattr(site, "PROGRAMS", ())
    with pytest.raises(row.Absent, match=r"no browser|playwright"):
        next(site.measure(TINY, tmp_path))
    monkeypatch.setattr(row.ctypes, "CDLL", lambda name: (_ for _ in ()).throw(OSError))
    with pytest.raises(row.Absent, match="no CUDA device"):
        row.cuda_name()


def test_a_row_ends_with_its_bench(tmp_path: Path) -> None:
    command = [sys.executable, "-m", process.__name__, "bake, processor", str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as measuring:
        assert measuring.stdin is not None
        measuring.stdin.write(pickle.dumps(card.FULL))
        measuring.stdin.close()
        assert measuring.wait() == 1


def test_without_an_adapter_a_row_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> None:
        raise UserError("no graphics adapter found")

    monkeypatch.setattr("lambent.realtime.gpu.device.choose_adapter", none)
    with pytest.raises(row.Absent, match="no graphics adapter found"):
        row.adapter_name()
