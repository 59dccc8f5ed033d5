"""Blender, as the package bpy, in processes of its own: it changes the state of the one it runs in."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
Run = Callable[..., Any]


@pytest.fixture(scope="session")
def blender() -> Run:
    """Runs a script of `blender_scenes` with arguments; returns what it says after `truth: `."""
    if find_spec("bpy") is None:
        pytest.skip("Blender as a package is not installed: `python3 run.py test` does it with Python 3.11")
    loads = subprocess.run([sys.executable, "-c", "import bpy"], capture_output=True, text=True)
    if loads.returncode != 0:
        pytest.skip(f"Blender as a package does not load here: {loads.stderr.strip().splitlines()[-1]}")

    def run(script: str, *arguments: object) -> Any:
        command = [sys.executable, "-W", "ignore", HERE / "blender_scenes" / f"{script}.py", *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True)
        said = [line for line in done.stdout.splitlines() if line.startswith("truth: ")]
        assert done.returncode == 0 and said, done.stdout[-2000:] + done.stderr[-4000:]
        return json.loads(said[-1].removeprefix("truth: "))

    return run
