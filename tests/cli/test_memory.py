"""Memory that is used up ends a command with one line and code 2."""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image


@pytest.mark.parametrize("error", [MemoryError(), ImportError("a.so: failed to map segment from shared object")])
def test_an_error_of_memory_is_one_line(refused, monkeypatch, tmp_path: Path, error: Exception) -> None:
    def fails(*_: object) -> None:
        raise error

    Image.new("L", (8, 8)).save(tmp_path / "a.png")
    monkeypatch.setattr("lambent.core.pictures.images.read_image", fails)
    assert "out of memory" in refused("inspect", tmp_path / "a.png")


def test_a_picture_larger_than_the_memory(tmp_path: Path) -> None:
    """800 MB of pixels in a process that may have 900 MB."""
    Image.new("L", (8192, 8192)).save(tmp_path / "a.png")
    done = subprocess.run(
        [sys.executable, "-m", "lambent.cli.main", "inspect", str(tmp_path / "a.png")],
        capture_output=True, text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (900 << 20, 900 << 20)),
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (2, ""), done
    assert done.stderr.splitlines()[-1].startswith("lambent: error: out of memory"), done.stderr
    assert "Traceback" not in done.stderr
