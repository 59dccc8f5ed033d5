"""Benches are found, run in one form, and their reports are JSON."""

from __future__ import annotations

import inspect
import json
import sys

import pytest

from lambent import bench
from lambent.bench import load
from lambent.bench.registry import benches, run_bench
from lambent.core.errors import UserError
from tests.viewer.small_store import write_small_store

RULER = """
NAME, FULL, QUICK = "ruler", 2, 1

def run(effort, inputs=(), progress=None):
    rows = [{"file": path.name, "bytes": path.stat().st_size} for path in inputs]
    return {"rows": rows, "summary": {"effort": effort}}
"""


@pytest.fixture
def ruler(monkeypatch, tmp_path):
    """A bench that measures the length of its input: one file in a folder that joins the package."""
    folder = tmp_path / "more"
    folder.mkdir()
    (folder / "ruler.py").write_text(RULER)
    monkeypatch.setattr(bench, "__path__", [*bench.__path__, str(folder)])
    yield
    sys.modules.pop("lambent.bench.ruler", None)


def test_every_bench_has_the_agreed_face():
    for name, module in benches().items():
        assert type(module.FULL) is type(module.QUICK) and module.FULL != module.QUICK, name
        parameters = list(inspect.signature(module.run).parameters)
        assert parameters[0] == "effort" and parameters[-1] == "progress", name
        assert set(parameters[1:-1]) <= {"inputs", "against", "reference", "settings", "output"}, name


def test_report(ruler, tmp_path):
    (tmp_path / "a").write_bytes(b"12345")
    report = json.loads(json.dumps(run_bench("ruler", "quick", inputs=[tmp_path / "a"])))
    assert list(report) == ["bench", "machine", "inputs", "rows", "summary"]
    assert report["machine"]["cpu"]
    assert {"cpu", "cores", "adapter", "adapter_type", "driver", "variant"} == set(report["machine"])
    sha256 = "5994471abb01112afcc18159f6cc74b4f511b99806da59b3caf5a9c173cacfc5"
    assert report["inputs"] == [{"path": "a", "sha256": sha256}]
    assert report["rows"] == [{"file": "a", "bytes": 5}]
    assert report["summary"] == {"effort": 1}
    assert run_bench("ruler")["summary"] == {"effort": 2} and run_bench("ruler", 7)["summary"] == {"effort": 7}


def test_unknown_bench_and_input(ruler, tmp_path):
    with pytest.raises(UserError, match="did you mean 'ruler'"):
        run_bench("rulers")
    with pytest.raises(UserError, match="input does not exist"):
        run_bench("ruler", inputs=[tmp_path / "absent"])


def test_files_that_a_bench_does_not_read(ruler, tmp_path):
    (tmp_path / "a").write_bytes(b"1")
    for name in ("walk-cube", "planar-quality"):
        with pytest.raises(UserError, match="takes no inputs"):
            run_bench(name, inputs=[tmp_path / "a"])
    with pytest.raises(UserError, match="-o: this bench writes no file"):
        run_bench("ruler", output=tmp_path / "b")
    with pytest.raises(UserError, match="takes no published fits"):
        run_bench("ruler", against=[tmp_path / "a"])


def test_time_and_memory_of_a_process():
    """A process that holds 200 MB for a quarter of a second."""
    program = "import time; held = bytearray(200_000_000); held[::4096] = b'x' * len(held[::4096]); time.sleep(.25)"
    seconds, peak_mb = load.timed([sys.executable, "-c", program])
    assert seconds >= 0.25
    assert peak_mb is None or 200 < peak_mb < 300
    with pytest.raises(UserError, match="command failed"):
        load.timed([sys.executable, "-c", "raise SystemExit(3)"])


@pytest.mark.long
def test_load_counts_time_memory_and_what_the_gpu_holds(adapter, monkeypatch, tmp_path):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    store = write_small_store(tmp_path / "small.store")
    report = run_bench("load", load.Effort(32, 24, runs=1), inputs=[store])
    start, render = report["rows"]
    assert (start["command"], render["command"], start["gpu_mb"]) == ("--help", "render", None)
    assert 0 < start["seconds_to_first_frame"] < render["seconds_to_first_frame"]
    assert 0.1 < render["gpu_mb"] < 1000
    assert report["summary"] == {"width": 32, "height": 24, "runs": 1, "store": "small.store"}
