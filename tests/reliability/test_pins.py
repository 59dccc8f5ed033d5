"""Pinned versions, by what the package registry says of them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

PINS = Path(__file__).parents[2] / "constraints.txt"


@pytest.mark.long
def test_every_pin_is_offered_and_none_is_withdrawn(tmp_path: Path) -> None:
    """Makers yank versions with faults, and registries remove malicious ones: pip says so of the first."""
    pip = [sys.executable, "-m", "pip", "install", "--dry-run", "--no-deps", "--ignore-installed", "--no-input"]
    report = tmp_path / "report.json"
    done = subprocess.run([*pip, "--report", report, "-r", PINS], capture_output=True, text=True)
    if "ConnectionError" in done.stderr or "NewConnectionError" in done.stderr:
        pytest.skip("the package registry cannot be reached")
    assert done.returncode == 0, done.stderr[-2000:]
    assert "yanked" not in done.stderr
