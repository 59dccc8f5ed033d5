"""A window that exchanges its mode frees the renderer of the one before."""

import json
import os
import subprocess
import sys

import pytest

from tests.viewer.small_store import write_small_store
from tests.viewer.window_session import ROOT

EXCHANGES = """
import gc, json, sys
from functools import partial
from pathlib import Path
from lambent.realtime.renderer import Renderer
from lambent.viewer import app
from lambent.viewer.exchange import WALK, exchanged
from lambent.viewer.modes.walk.mode import WalkMode
advance, store, counts = WalkMode.advance, Path(sys.argv[1]), []
def exchanging(mode, dt_s):
    advance(mode, dt_s)
    if mode.drawing.shown[0].view is None or mode.screen.enter is not None:
        return
    counts.append(sum(isinstance(one, Renderer) for one in gc.get_objects()))
    if len(counts) < 4:
        mode.screen.enter = partial(exchanged, store=store, before=WALK, name=WALK)
    else:
        mode.screen.closes = True
gc.disable()
WalkMode.advance, WalkMode.moving = exchanging, property(lambda mode: True)
app.run(store, size=(320, 240), folder=store.parent)
print(json.dumps(counts))
"""


@pytest.mark.long
def test_renderers_of_modes_before_are_freed(virtual_screen, tmp_path):
    store = write_small_store(tmp_path / "small")
    environment = {**os.environ, "DISPLAY": virtual_screen.name}
    environment.pop("WAYLAND_DISPLAY", None)
    command = [sys.executable, "-c", EXCHANGES, str(store)]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == [1, 1, 1, 1]
