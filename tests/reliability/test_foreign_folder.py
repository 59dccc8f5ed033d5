"""A folder that came with a scene may hold modules, plugins and settings: nothing that Lambent starts takes them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.surfaces.parametrization import laid_flat
from lambent.core.errors import UserError
from lambent.core.machine import python_environment
from lambent.scenes.geometry import box
from lambent.viewer.background.worker_process import WorkerProcess
from lambent.viewer.modes.walk.comparison import flip_in_process

ROOT = Path(__file__).parents[2]
NAMES = "lambent", "numpy", "xatlas", "json", "pickle", "subprocess", "ctypes", "multiprocessing", "concurrent", "pip"
PLUGINS = "area", "constant", "independent", "merge", "path", "point", "rectangle", "srgb"


@pytest.fixture
def foreign(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, whose modules say so in a file when they are imported."""
    for name in NAMES:
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'imported')!r}, 'a').write({name!r} + ' ')\n")
    (tmp_path / "plugins").mkdir()
    for name in PLUGINS:
        (tmp_path / "plugins" / f"{name}.so").write_text("Mitsuba fails on this")
    (tmp_path / ".numba_config.yaml").write_text("cache_dir: here\ncache_locator_classes: its.Own\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    subprocess.run([sys.executable, "-c", "import json"], check=True)
    assert (tmp_path / "imported").read_text() == "json ", "Python itself would"
    (tmp_path / "imported").unlink()
    return tmp_path


def test_processes_of_one_window_and_of_a_bake(foreign: Path) -> None:
    mesh = box((1, 1, 1))
    [(_, _, uv)] = laid_flat([(mesh.positions, mesh.faces.astype(np.uint32), mesh.normals)])
    assert np.isfinite(uv).all()
    picture = np.full((16, 16, 3), 0.5)
    assert flip_in_process(picture, picture, lambda *_: None).max() < 1e-5
    worker = WorkerProcess("lambent.core.machine", [], "nothing", lambda *_: None, ends=True)
    while worker.running:
        assert worker._work is not None
        worker._work.wait()
    assert not worker.error and not (foreign / "imported").exists()


@pytest.mark.long
@pytest.mark.parametrize("words", [["doctor"], ["bake", "builtin:box", "-o", "box.store", "--quality", "draft"]])
def test_commands(foreign: Path, words: list[str]) -> None:
    program = Path(sys.executable).with_name("lambent")
    done = subprocess.run([program, *words], capture_output=True, text=True)
    assert done.returncode in (0, 1) and not (foreign / "imported").exists(), done.stderr
    subprocess.run([sys.executable, ROOT / "run.py", "lambent", "--version"], check=True)
    assert not (foreign / "imported").exists()


def test_settings_of_numba(foreign: Path) -> None:
    """A cache of compiled functions is code."""
    shown = "import numba.core.config as c; print([c.CACHE_DIR, c.CACHE_LOCATOR_CLASSES])"
    environment = {name: value for name, value in python_environment().items() if not name.startswith("NUMBA_CACHE")}
    for before, found in (("", ["here", "its.Own"]), ("import lambent; ", ["", ""])):
        command = [sys.executable, "-c", before + shown]
        done = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
        assert done.stdout.strip() == str(found)


def test_plugins_of_mitsuba(foreign: Path, mi: Any) -> None:
    from lambent.baking.engine import engine

    engine.cache_clear()
    engine()
    assert mi.load_dict({"type": "independent"}) is not None
    (foreign / "plugins" / "lambent_material.so").write_text("Mitsuba looks here for what Lambent registers")
    engine.cache_clear()
    with pytest.raises(UserError, match=r"lambent_material\.so: would be loaded by Mitsuba"):
        engine()


def test_every_module_that_starts_this_python_gives_it_that_environment() -> None:
    texts = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "lambent").rglob("*.py")}
    starting = {name for name, text in texts.items() if "sys.executable" in text}
    assert len(starting) > 5
    without = {name for name in starting if "python_environment()" not in texts[name]}
    assert without == {"blender.py"}, "which names its script by its path"


def test_modules_are_found_where_this_process_finds_them() -> None:
    found = python_environment()
    assert found["PYTHONPATH"].split(os.pathsep) == [place or os.getcwd() for place in sys.path]
    assert found["PYTHONSAFEPATH"] == "1"
