"""What is kept when the window is lost."""

import errno
import os
import shutil
import signal
import subprocess
import sys

import pytest

from lambent.core.views.camera import Camera
from lambent.materials.document import load_material
from lambent.store.kept.session import FILE, read_session
from lambent.store.kept.views import Views
from lambent.viewer.background.lost import kept
from lambent.viewer.mode import Drawing
from lambent.viewer.modes.walk.input import WalkInput
from lambent.viewer.modes.walk.mode import WalkMode
from lambent.viewer.modes.walk.state import WalkState
from tests.viewer.small_store import write_small_store
from tests.viewer.window_session import ROOT, VirtualScreen, WindowSession


class Ended(Drawing):
    """Counts how often it was closed."""

    times = 0

    def close(self):
        self.times += 1


@pytest.fixture
def mode(scene, screen, geometry, tmp_path, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    (tmp_path / "store").mkdir()
    state = WalkState.of(scene, "walk", screen, tmp_path / "store")
    return WalkMode(state, WalkInput(state, geometry), Ended(None))


@pytest.fixture
def state(mode):
    return mode.state


def walk_and_edit(state):
    state.materials.edits.change("brass", state.scene.materials["brass"].model_copy(update={"kd": (0.3, 0.3, 0.3)}))
    state.recordings.record()
    for k in range(1, 20):
        state.screen.clock.now_s = 0.1 * k
        state.navigation.camera = Camera(name="free", position=(0.1 * k, 1.6, 0), target=(0.1 * k, 1.6, -1))
        state.recordings.recorder.take(state.navigation.camera, state.screen.clock.now_s)


def test_an_error_keeps_the_material_and_the_walk_once(mode, state, tmp_path, capsys):
    walk_and_edit(state)
    with pytest.raises(ZeroDivisionError), kept(mode.rescue):
        raise ZeroDivisionError
    assert load_material(tmp_path / "brass-rescued-001.json").kd == (0.3, 0.3, 0.3)
    assert [path.name for path in state.recordings.views.saved.paths] == ["walk 1"] and mode.drawing.times == 1
    assert "brass-rescued-001.json" in capsys.readouterr().err
    assert not (tmp_path / "brass-rescued-002.json").exists()


def test_closing_in_order_keeps_nothing_aside(mode, state, tmp_path):
    walk_and_edit(state)
    before = signal.getsignal(signal.SIGTERM)
    with kept(mode.rescue):
        assert signal.getsignal(signal.SIGTERM) != before
    assert signal.getsignal(signal.SIGTERM) == before
    assert [p.name for p in tmp_path.iterdir()] == ["store"]


def test_a_store_that_is_gone_is_not_made_anew(state, tmp_path):
    walk_and_edit(state)
    shutil.rmtree(tmp_path / "store")
    state.recordings.save_view()
    assert "store was deleted or moved" in state.screen.messages[-1].text and not (tmp_path / "store").exists()
    (said,) = state.recordings.rescue()
    file = tmp_path / "walk 1-rescued-001.json"
    assert str(file) in said
    assert [p.name for p in Views.model_validate_json(file.read_text()).paths] == ["walk 1"]


@pytest.mark.long
def test_a_window_that_loses_its_display_keeps_its_material(virtual_screen, tmp_path):
    screen = VirtualScreen()
    session = WindowSession(screen, write_small_store(tmp_path / "store"), tmp_path)
    try:
        session.click(213, 220)
        session.wait_for(lambda state: state["selected"] == "ball")
        session.drag(session.point("mx", 0.5), session.point("mx", 0.8))
        seen = session.wait_for(lambda state: state["edited"])
        screen.close()
        code = session.process.wait(40)
    finally:
        session.kill()
        screen.close()
    assert code == 1, session.log()
    rescued = read_session(tmp_path / "store" / FILE).now.materials["brass"]
    assert rescued.model_dump(mode="json")["lobes"] == seen["edited"]["brass"]["lobes"]


def test_a_signal_ends_the_process_after_the_rescue():
    code = """
import os
from lambent.viewer.background.lost import kept
with kept(lambda: print("saved", flush=True)):
    os.kill(os.getpid(), 15)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == -signal.SIGTERM and done.stdout == "saved\n", done.stderr


@pytest.mark.parametrize("thread", ["main", "other"])
def test_an_abort_of_the_driver_ends_the_process_after_the_rescue(thread):
    code = f"""
import ctypes, threading
from lambent.viewer.background.lost import kept
with kept(lambda: print("saved", flush=True)):
    abort = ctypes.CDLL(None).abort
    if {thread!r} == "main":
        abort()
    started = threading.Thread(target=abort)
    started.start()
    started.join()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 1 and done.stdout == "saved\n", done.stderr
    assert done.stderr.startswith("lambent: error: the display was lost"), done.stderr


def test_a_walk_that_can_be_kept_nowhere_is_said(mode, state, capsys, monkeypatch):
    def refused(*_, **__):
        raise PermissionError(errno.EACCES, "Permission denied")

    walk_and_edit(state)
    monkeypatch.setattr("os.open", refused)
    state.materials.edits.undo()
    mode.close()
    said = capsys.readouterr().err
    assert said.startswith("lambent: note: the recorded walk could not be saved: ") and said.count("\n") == 1
    assert "walk 1-rescued-001.json: cannot be written (Permission denied)" in said


LOSES_ITS_DEVICE = """
import sys
from lambent.cli import main
from lambent.viewer.modes.walk.mode import WalkMode
advance, frames = WalkMode.advance, []
def lost(mode, dt_s):
    advance(mode, dt_s)
    frames.append(dt_s)
    if len(frames) == 3:
        edits = mode.state.materials.edits
        edits.change("brass", edits.current("brass").model_copy(update={"kd": (0.3, 0.3, 0.3)}))
        mode.drawing.device.destroy()
WalkMode.advance, WalkMode.moving = lost, property(lambda mode: True)
sys.exit(main.run(["walk", sys.argv[1]]))
"""


@pytest.mark.long
def test_a_lost_device_keeps_the_session(virtual_screen, tmp_path):
    store = write_small_store(tmp_path / "small")
    environment = {**os.environ, "DISPLAY": virtual_screen.name}
    environment.pop("WAYLAND_DISPLAY", None)
    command = [sys.executable, "-c", LOSES_ITS_DEVICE, str(store)]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=600)
    *_, error = done.stderr.splitlines()
    assert done.returncode == 2 and error.startswith("lambent: error: the graphics device was lost"), done.stderr
    assert "Traceback" not in done.stderr and read_session(store / FILE).now.materials["brass"].kd == (0.3, 0.3, 0.3)
