"""A disk that fills up while a window saves: one line with the file's name, and the former file is whole."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the limit on files' sizes is of POSIX")
SAVE = """
import resource, sys
from dataclasses import replace
from pathlib import Path
from lambent.cli import main
from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.store.kept import session, views
def save(folder):
    states = {f"{n}": session.RoomState(materials={"a": Material(kd=0.1)}) for n in range(20)}
    session.write_session(folder / session.FILE, session.WalkSession(states=states))
def change(folder):
    eye = Camera("a", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    views.change_views(folder, lambda _: views.Views(cameras=tuple(replace(eye, name=f"{n}") for n in range(20))))
resource.setrlimit(resource.RLIMIT_FSIZE, (600, 600))
for work in (save, change):
    try:
        work(Path.cwd())
    except UserError as error:
        main._fail(str(error))
"""


def test_what_a_window_saves(tmp_path: Path) -> None:
    former = json.dumps({"format": "lambent-walk-session", "version": 2})
    (tmp_path / "session.json").write_text(former)
    done = subprocess.run([sys.executable, "-c", SAVE], capture_output=True, text=True, cwd=tmp_path)
    lines = done.stderr.splitlines()
    assert len(lines) == 2 and all("cannot be written" in line and ".lambent-" not in line for line in lines), lines
    assert "session.json" in lines[0] and "views.json" in lines[1]
    assert (tmp_path / "session.json").read_text() == former and not (tmp_path / "views.json").exists()
    assert not list(tmp_path.glob(".lambent-*"))
