"""The session of a store: saved with it, opened with it, brought back after a crash; one window keeps it."""

import json

import pytest

from lambent.core.errors import UserError
from lambent.core.light.light_mix import GroupMix, LightMix
from lambent.materials.document import Material
from lambent.store.kept.session import FILE, UNSAVED_FILE, RoomState, WalkSession, read_session, write_session
from lambent.viewer.edits.edits import MaterialEdits
from lambent.viewer.modes.walk.session.keeping import BACK, ELSEWHERE, QUIET_S, SessionKeeper
from lambent.viewer.screen import Rect, Screen
from tests.viewer.conftest import Clock

SCENE = {"plaster": Material(name="plaster", kd=0.6), "brass": Material(name="brass", kd=0.1)}
RED, BLUE = Material(name="plaster", kd=(0.7, 0.1, 0.1)), Material(name="plaster", kd=(0.1, 0.1, 0.7))
DIM = LightMix({"lamp": GroupMix(intensity=0.5)})


class Window:
    """The edits of one window, and their keeper."""

    def __init__(self, folder):
        self.screen = Screen(folder, Clock(), Rect(0, 0, 400, 300))
        self.edits = MaterialEdits(SCENE)
        self.keeper = SessionKeeper(self.edits, folder, self.screen)
        self.lines = self.keeper.open(["lamp"])

    def paint(self, material):
        self.edits.change("plaster", material)
        self.edits.end_stroke()

    def rest(self):
        """Time enough for what is unsaved to be written."""
        self.keeper.tick()
        self.screen.clock.now_s += QUIET_S
        self.keeper.tick()
        self.keeper._finish()

    def die(self):
        """As by kill -9: the lock goes with the process, files stay."""
        self.keeper._release()


@pytest.fixture
def window(tmp_path):
    opened = Window(tmp_path)
    yield opened
    opened.keeper.close()


def test_a_saved_session_is_there_again(window, tmp_path):
    window.paint(RED)
    window.edits.mix(DIM)
    window.edits.end_stroke()
    window.edits.store("evening")
    window.edits.compare_with(RoomState())
    assert set(window.keeper.unsaved) >= {"plaster", "the light mix", "stored states"}
    assert window.keeper.save() and window.keeper.unsaved == ()
    window.keeper.close()
    again = Window(tmp_path)
    assert again.lines == () and again.keeper.unsaved == ()
    assert again.edits.session == window.edits.session and again.edits.current("plaster") == RED
    assert not again.edits.can_undo
    again.keeper.close()


def test_a_lost_window_leaves_its_changes_and_undo_brings_the_saved_ones_back(window, tmp_path):
    window.paint(RED)
    window.keeper.save()
    window.paint(BLUE)
    window.rest()
    window.die()
    again = Window(tmp_path)
    assert again.lines == (BACK,) and again.edits.current("plaster") == BLUE and again.keeper.unsaved == ("plaster",)
    again.edits.undo()
    assert again.edits.current("plaster") == RED and again.keeper.unsaved == ()
    again.rest()
    assert not (tmp_path / UNSAVED_FILE).exists(), "nothing is unsaved any more"
    again.keeper.close()


def test_a_drag_is_written_when_it_is_over(window, tmp_path):
    window.edits.change("plaster", RED)
    window.rest()
    assert not (tmp_path / UNSAVED_FILE).exists()
    window.edits.end_stroke()
    window.rest()
    assert read_session(tmp_path / UNSAVED_FILE).now.materials == {"plaster": RED}
    assert not (tmp_path / FILE).exists()


def test_changes_are_written_once_they_rest(window, tmp_path):
    window.paint(RED)
    window.keeper.tick()
    assert window.keeper.wait_s() == QUIET_S
    window.screen.clock.now_s += 0.75 * QUIET_S
    window.keeper.tick()
    window.keeper._finish()
    assert window.keeper.wait_s() == pytest.approx(QUIET_S / 4) and not (tmp_path / UNSAVED_FILE).exists()
    window.screen.clock.now_s += QUIET_S
    assert window.keeper.wait_s() == 0
    window.keeper.tick()
    window.keeper._finish()
    assert window.keeper.wait_s() is None and (tmp_path / UNSAVED_FILE).exists()


def test_discarding_keeps_the_saved_session_alone(window, tmp_path):
    window.paint(RED)
    window.keeper.save()
    window.paint(BLUE)
    window.rest()
    window.keeper.discard()
    assert not (tmp_path / UNSAVED_FILE).exists()
    assert read_session(tmp_path / FILE).now.materials == {"plaster": RED}


def test_one_window_keeps_the_session(window, tmp_path):
    other = Window(tmp_path)
    assert other.lines == (ELSEWHERE,)
    other.paint(RED)
    other.rest()
    assert not other.keeper.save() and ELSEWHERE in other.screen.messages[-1].text
    assert not (tmp_path / FILE).exists() and not (tmp_path / UNSAVED_FILE).exists()
    window.keeper.close()
    third = Window(tmp_path)
    assert third.keeper.save()
    third.keeper.close()


def test_unknown_names_are_one_line_and_stay_in_the_file(window, tmp_path):
    window.keeper.close()
    chrome = Material(name="chrome", kd=0.2)
    mix = LightMix({"moon": GroupMix(on=False)})
    write_session(tmp_path / FILE, WalkSession(now=RoomState(materials={"chrome": chrome, "plaster": RED}, light=mix)))
    again = Window(tmp_path)
    (line,) = again.lines
    assert "chrome, moon" in line and "\n" not in line
    assert dict(again.edits.edited) == {"plaster": RED} and again.keeper.unsaved == ()
    again.paint(BLUE)
    assert again.keeper.save()
    saved = read_session(tmp_path / FILE).now
    assert saved.materials == {"chrome": chrome, "plaster": BLUE} and saved.light == mix
    again.keeper.close()


def test_textures_of_variants_are_kept(window, tmp_path):
    window.edits.take(RoomState(materials={"plaster": RED}, textures={"plaster": "brass", "chrome": "brass"}))
    assert window.edits.room.textures == {"plaster": "brass"} and "the texture of plaster" in window.keeper.unsaved
    assert window.keeper.save() and read_session(tmp_path / FILE).now.textures == {"plaster": "brass"}


def edited(said, **changes):
    return {**said, **changes}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"version": 2}, "unknown version; found 2; expected 1"),
        ({"format": "lambent-views"}, "is not a session of a store"),
        ({"now": {"materials": {}, "light": {"groups": {"lamp": {"intensity": -1}}}}}, "intensity is out of range"),
        ({"shadows": True}, "unknown key"),
        ({"states": {"day": {"materials": {"plaster": {"kd": "red"}}}}}, "states.day.materials.plaster"),
    ],
)
def test_a_session_that_cannot_be_read_is_one_line_and_is_kept(window, tmp_path, change, words):
    window.keeper.close()
    text = json.dumps(edited(WalkSession().model_dump(mode="json"), **change))
    (tmp_path / FILE).write_text(text)
    with pytest.raises(UserError) as raised:
        read_session(tmp_path / FILE)
    assert words in str(raised.value) and "\n" not in str(raised.value)
    again = Window(tmp_path)
    assert len(again.lines) == 1 and words in again.lines[0] and (tmp_path / FILE).read_text() == text
    again.paint(RED)
    assert again.keeper.save()
    assert (tmp_path / "session-kept-001.json").read_text() == text
    assert read_session(tmp_path / FILE).now.materials == {"plaster": RED}
    again.keeper.close()


def test_unsaved_changes_that_cannot_be_read_are_moved_aside(window, tmp_path):
    window.keeper.close()
    (tmp_path / UNSAVED_FILE).write_text("{")
    again = Window(tmp_path)
    assert len(again.lines) == 1 and "session-unsaved-kept-001.json" in again.lines[0]
    assert (tmp_path / "session-unsaved-kept-001.json").read_text() == "{"
    again.keeper.close()


def test_a_store_that_is_gone_is_said(window, tmp_path):
    window.paint(RED)
    (tmp_path / ".session.lock").unlink()
    tmp_path.rmdir()
    assert not window.keeper.save() and "store was deleted or moved" in window.screen.messages[-1].text
    assert not window.keeper.keeps


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path, monkeypatch):
    def refused(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("lambent.store.kept.session.os.open", refused)
    opened = Window(tmp_path)
    assert opened.lines == (f"the session cannot be saved: {tmp_path}: cannot be written (Permission denied)",)
    opened.paint(RED)
    opened.rest()
    assert opened.keeper.unsaved == ("plaster",) and not opened.keeper.keeps
