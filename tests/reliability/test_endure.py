"""A few rounds of `endure`, and that it notices what a killed process breaks."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.store.kept.session import FILE
from tests.reliability import endure, endured
from tests.reliability.endure import Endurance, Result


def torn(folder: Path) -> None:
    """Write in place and wait to be killed: what no writer of Lambent does."""
    (folder / FILE).write_text('{"format": ')
    (folder / FILE).write_text(json.dumps({"format": "lambent-walk-session", "version": 2}))
    (folder / "views.json").write_text("{")
    time.sleep(1)
    (folder / "views.json").unlink()


@pytest.mark.long
def test_saves_of_a_session_survive_kills(tmp_path: Path) -> None:
    one, result = Endurance("session", tmp_path), Result()
    for seed in range(2):
        one.round(np.random.default_rng(seed), result)
    assert result.rounds["session"] == 2 and result.kills["session"] + result.too_late["session"] >= 2
    assert set(one.whole) == {FILE, "views.json"}


@pytest.mark.slow
def test_a_torn_file_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    content: Callable[[Path], dict[str, bytes]] = lambda folder: {FILE: (folder / FILE).read_bytes()}  # noqa: E731
    broken = replace(endured.JOBS["session"], work=torn, content=content)
    monkeypatch.setitem(endure.JOBS, "broken", broken)
    result = endure.run(tmp_path, ["broken"], seed=0, rounds=3, until_s=time.monotonic() + 600)
    assert any("views.json" in said for said in result.failures.values()), result
