"""Benches are found, run in one form, and their reports are JSON."""

from __future__ import annotations

import json
import sys
from types import ModuleType

import pytest

from lambent.bench import load, registry
from lambent.bench.registry import benches, run_bench
from lambent.core.errors import UserError


@pytest.fixture
def ruler(monkeypatch):
    """A bench that measures the length of its input."""
    module = ModuleType("lambent.bench.ruler")
    module.NAME = "ruler"
    module.run = lambda quick, inputs, progress: {
        "rows": [{"file": path.name, "bytes": path.stat().st_size} for path in inputs],
        "summary": {"quick": quick},
    }
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(registry, "benches", lambda: {"ruler": module.__name__})


def test_discovery_finds_load():
    assert benches()["load"] == "lambent.bench.load"


def test_every_bench_has_the_agreed_face():
    for name, module in benches().items():
        assert callable(sys.modules[module].run), name


def test_report(ruler, tmp_path):
    (tmp_path / "a").write_bytes(b"12345")
    report = json.loads(json.dumps(run_bench("ruler", quick=True, inputs=[tmp_path / "a"])))
    assert list(report) == ["bench", "machine", "inputs", "rows", "summary"]
    assert report["machine"]["cpu"]
    assert {"cpu", "cores", "adapter", "adapter_type", "driver", "variant"} == set(report["machine"])
    sha256 = "5994471abb01112afcc18159f6cc74b4f511b99806da59b3caf5a9c173cacfc5"
    assert report["inputs"] == [{"path": "a", "sha256": sha256}]
    assert report["rows"] == [{"file": "a", "bytes": 5}]
    assert report["summary"] == {"quick": True}


def test_unknown_bench_and_input(ruler, tmp_path):
    with pytest.raises(UserError, match="did you mean 'ruler'"):
        run_bench("rulers")
    with pytest.raises(UserError, match="input does not exist"):
        run_bench("ruler", inputs=[tmp_path / "absent"])


def test_time_and_memory_of_a_process():
    """A process that holds 200 MB for a quarter of a second."""
    program = "import time; held = bytearray(200_000_000); held[::4096] = b'x' * len(held[::4096]); time.sleep(.25)"
    seconds, peak_mb = load.timed([sys.executable, "-c", program])
    assert seconds >= 0.25
    assert peak_mb is None or 200 < peak_mb < 300
    with pytest.raises(UserError, match="command failed"):
        load.timed([sys.executable, "-c", "raise SystemExit(3)"])
