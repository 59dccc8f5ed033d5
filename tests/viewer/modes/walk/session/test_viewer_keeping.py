"""The session of a store: always current on disk, opened with it; one window keeps it, another is read-only."""

import json
import threading

import pytest

from lambent.core.errors import UserError
from lambent.core.light.false_colour import Range
from lambent.core.light.light_mix import GroupMix, LightMix
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.scenes.scene import ImageTexture
from lambent.store.kept.session import (
    FILE,
    FORMER_BACKUP,
    KeptLook,
    KeptView,
    RoomState,
    WalkSession,
    read_session,
    write_session,
)
from lambent.viewer.edits.edits import MaterialEdits
from lambent.viewer.edits.keeping import BACK, SessionKeeper
from lambent.viewer.edits.session_file import ASK_S, CHANGED, READ_ONLY, TAKEN
from lambent.viewer.modes.walk.session.kept_view import restore, show_view, view_of
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.screen import Rect, Screen
from tests.viewer.conftest import Clock

SCENE = {"plaster": Material(name="plaster", kd=0.6), "brass": Material(name="brass", kd=0.1)}
RED, BLUE = Material(name="plaster", kd=(0.7, 0.1, 0.1)), Material(name="plaster", kd=(0.1, 0.1, 0.7))
DIM = LightMix({"lamp": GroupMix(intensity=0.5)})
THERE = Camera("free", (1.0, 1.6, 2.0), (0.0, 1.0, 0.0), fov_y_deg=50.0)
HOURS_S = 3600.0


class Window:
    """The edits of one window, and their keeper; it writes when `rest` or its end tells it to."""

    def __init__(self, folder, **how):
        self.screen = Screen(folder, Clock(), Rect(0, 0, 400, 300))
        self.edits = MaterialEdits(SCENE)
        self.keeper = SessionKeeper(self.edits, folder, self.screen, HOURS_S)
        self.lines = self.keeper.open(["lamp"], **how)

    def paint(self, material):
        self.edits.change("plaster", material)
        self.edits.end_stroke()

    def rest(self):
        """Until what is due is written."""
        self.keeper.tick()
        self.keeper._finish()

    def die(self):
        """As by kill -9: the lock goes with the process, files stay."""
        self.keeper._release()

    def look_around(self, camera):
        self.keeper.view = lambda: KeptView(camera=camera)

    @property
    def said(self):
        return [message.text for message in self.screen.messages]


@pytest.fixture
def window(tmp_path):
    opened = Window(tmp_path)
    yield opened
    opened.keeper.close()


def on_disk(folder):
    return read_session(folder / FILE)


def test_a_session_is_there_again(window, tmp_path):
    window.paint(RED)
    window.edits.mix(DIM)
    window.edits.end_stroke()
    window.edits.store("evening")
    window.edits.compare_with(RoomState())
    window.look_around(THERE)
    assert window.keeper.unsaved == ()
    window.keeper.close()
    again = Window(tmp_path)
    assert again.lines == () and again.keeper.opened.view.camera == THERE
    assert again.edits.session == window.edits.session and again.edits.current("plaster") == RED
    assert not again.edits.can_undo
    again.keeper.close()


def test_a_window_that_only_opened_writes_nothing(window, tmp_path):
    window.rest()
    window.keeper.close()
    assert [file.name for file in tmp_path.iterdir()] == [".session.lock"]


def test_a_change_is_on_disk_when_a_window_dies_and_an_undo_too(window, tmp_path):
    window.paint(RED)
    window.rest()
    window.paint(BLUE)
    window.rest()
    assert on_disk(tmp_path).now.materials == {"plaster": BLUE}
    window.edits.undo()
    window.rest()
    window.die()
    again = Window(tmp_path)
    assert again.lines == () and again.edits.current("plaster") == RED
    again.keeper.close()


def test_a_drag_is_written_while_it_goes_on(window, tmp_path):
    for kd in (0.2, 0.3, 0.4):
        window.edits.change("plaster", Material(name="plaster", kd=kd))
        window.rest()
        assert window.edits.in_stroke and on_disk(tmp_path).now.materials["plaster"].kd == (kd,) * 3


def test_later_changes_do_not_put_a_write_off_and_are_in_it(tmp_path, monkeypatch):
    """The first change sets the time; what is written then is the last."""
    waits, woken = [], threading.Event()
    opened = Window(tmp_path)
    opened.screen.wake = woken.set
    monkeypatch.setattr(opened.keeper, "_hurry", Waits(waits))
    opened.paint(RED)
    opened.keeper.tick()
    first = opened.keeper._work
    opened.paint(BLUE)
    opened.keeper.tick()
    assert opened.keeper._work is first and not (tmp_path / FILE).exists()
    opened.keeper._hurry.let_go()
    assert woken.wait(60), "the window hears of it while it sleeps"
    assert on_disk(tmp_path).now.materials == {"plaster": BLUE} and waits == [HOURS_S]
    opened.keeper.tick()
    assert opened.keeper._work is None
    opened.keeper.close()


class Waits:
    """An event whose waits last until `let_go`, and are recorded."""

    def __init__(self, waits):
        self._waits, self._event, self.let_go = waits, threading.Event(), None
        self.let_go = self.set = self._event.set

    def clear(self):
        self._event.clear()

    def wait(self, seconds):
        self._waits.append(seconds)
        self._event.wait()


def test_a_view_is_kept_like_an_edit(window, tmp_path):
    window.look_around(THERE)
    window.rest()
    assert on_disk(tmp_path).view.camera == THERE


def test_fresh_begins_as_baked_and_loses_nothing(window, tmp_path):
    window.paint(RED)
    window.keeper.close()
    before = (tmp_path / FILE).read_bytes()
    fresh = Window(tmp_path, fresh=True)
    assert fresh.lines == () and dict(fresh.edits.edited) == {} and fresh.keeper.opened.view is None
    fresh.look_around(THERE)
    fresh.rest()
    assert (tmp_path / FILE).read_bytes() == before, "to look around is no edit"
    fresh.paint(BLUE)
    fresh.rest()
    assert on_disk(tmp_path).now.materials == {"plaster": BLUE} and on_disk(tmp_path).view.camera == THERE
    assert (tmp_path / "session-kept-001.json").read_bytes() == before
    assert fresh.said == ["the earlier session is now session-kept-001.json"]
    fresh.keeper.close()


def test_images_of_sessions_set_aside_stay(window, tmp_path, monkeypatch):
    monkeypatch.setattr("lambent.viewer.edits.keeping.images_of_variants", lambda folder: set())
    (tmp_path / "images").mkdir()
    for name in ("bricks-1.png", "tiles-2.png", "gone-3.png"):
        (tmp_path / "images" / name).write_bytes(b"")
    window.edits.show_texture("plaster", ImageTexture("bricks-1.png"))
    window.keeper.save()
    window.die()
    fresh = Window(tmp_path, fresh=True)
    fresh.edits.show_texture("brass", ImageTexture("tiles-2.png"))
    fresh.keeper.close()
    assert {file.name for file in (tmp_path / "images").iterdir()} == {"bricks-1.png", "tiles-2.png"}


def test_a_second_window_is_read_only(window, tmp_path):
    other = Window(tmp_path)
    assert other.lines == (READ_ONLY,) and other.keeper.fault == READ_ONLY
    other.paint(RED)
    other.rest()
    assert not other.keeper.save() and other.said[-1] == READ_ONLY
    assert other.keeper.unsaved == ("plaster",), "to be asked for before it closes"
    other.keeper.close()
    assert not (tmp_path / FILE).exists()


def ask_again(window):
    window.screen.clock.now_s += ASK_S
    assert window.keeper.wait_s() == 0
    window.keeper.tick()


def test_it_takes_over_from_a_window_that_has_closed(window, tmp_path):
    other = Window(tmp_path)
    ask_again(other)
    assert other.keeper.fault == READ_ONLY
    window.keeper.close()
    other.paint(BLUE)
    ask_again(other)
    assert other.keeper.fault == "" and other.said == [TAKEN] and other.keeper.wait_s() is None
    other.rest()
    assert on_disk(tmp_path).now.materials == {"plaster": BLUE} and other.keeper.unsaved == ()
    third = Window(tmp_path)
    assert third.lines == (READ_ONLY,)
    other.keeper.close()


def test_it_stays_read_only_if_the_session_has_changed(window, tmp_path):
    other = Window(tmp_path)
    window.paint(RED)
    window.keeper.close()
    other.paint(BLUE)
    ask_again(other)
    assert other.keeper.fault == CHANGED and other.keeper.wait_s() is None
    other.keeper.close()
    assert on_disk(tmp_path).now.materials == {"plaster": RED}
    third = Window(tmp_path)
    assert third.lines == (), "the lock is free"
    third.keeper.close()


def test_unknown_names_are_one_line_and_stay_in_the_file(window, tmp_path):
    window.keeper.close()
    chrome = Material(name="chrome", kd=0.2)
    mix = LightMix({"moon": GroupMix(on=False)})
    write_session(tmp_path / FILE, WalkSession(now=RoomState(materials={"chrome": chrome, "plaster": RED}, light=mix)))
    again = Window(tmp_path)
    (line,) = again.lines
    assert "chrome, moon" in line and "\n" not in line
    assert dict(again.edits.edited) == {"plaster": RED}
    before = (tmp_path / FILE).stat().st_mtime_ns
    again.rest()
    assert (tmp_path / FILE).stat().st_mtime_ns == before
    again.paint(BLUE)
    again.rest()
    saved = on_disk(tmp_path).now
    assert saved.materials == {"chrome": chrome, "plaster": BLUE} and saved.light == mix
    again.keeper.close()


def test_textures_of_variants_are_kept(window, tmp_path):
    window.edits.take(RoomState(materials={"plaster": RED}, textures={"plaster": "brass", "chrome": "brass"}))
    assert window.edits.room.textures == {"plaster": "brass"}
    window.rest()
    assert on_disk(tmp_path).now.textures == {"plaster": "brass"}


def former(session):
    """A session as version 1 wrote it."""
    said = session.model_dump(mode="json", exclude={"view"})
    return json.dumps({**said, "version": 1})


def test_a_session_of_version_1_is_read_and_becomes_one_of_version_2(window, tmp_path):
    window.keeper.close()
    (tmp_path / FILE).write_text(former(WalkSession(now=RoomState(materials={"plaster": RED}))))
    again = Window(tmp_path)
    assert again.lines == () and again.edits.current("plaster") == RED and again.keeper.opened.view is None
    again.paint(BLUE)
    again.keeper.close()
    assert json.loads((tmp_path / FILE).read_text())["version"] == 2


def test_the_backup_of_version_1_is_folded_in_once(window, tmp_path):
    window.keeper.close()
    (tmp_path / FILE).write_text(former(WalkSession(now=RoomState(materials={"plaster": RED}))))
    (tmp_path / FORMER_BACKUP).write_text(former(WalkSession(now=RoomState(materials={"plaster": BLUE}))))
    again = Window(tmp_path)
    assert again.lines == (BACK,) and again.edits.current("plaster") == BLUE
    again.rest()
    assert on_disk(tmp_path).now.materials == {"plaster": BLUE} and not (tmp_path / FORMER_BACKUP).exists()
    again.edits.undo()
    assert again.edits.current("plaster") == RED
    again.keeper.close()


def test_fresh_sets_the_backup_of_version_1_aside_too(window, tmp_path):
    window.keeper.close()
    (tmp_path / FORMER_BACKUP).write_text(former(WalkSession(now=RoomState(materials={"plaster": BLUE}))))
    fresh = Window(tmp_path, fresh=True)
    fresh.paint(RED)
    fresh.keeper.close()
    assert read_session(tmp_path / "session-unsaved-kept-001.json").now.materials == {"plaster": BLUE}
    again = Window(tmp_path)
    assert again.lines == () and again.edits.current("plaster") == RED
    again.keeper.close()


def edited(said, **changes):
    return {**said, **changes}


def viewed(**changes):
    return {"view": {**KeptView(camera=THERE).model_dump(mode="json"), **changes}}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"version": 3}, "unknown version; found 3; expected 2"),
        ({"format": "lambent-views"}, "is not a session of a store"),
        ({"now": {"materials": {}, "light": {"groups": {"lamp": {"intensity": -1}}}}}, "intensity is out of range"),
        ({"shadows": True}, "unknown key"),
        ({"states": {"day": {"materials": {"plaster": {"kd": "red"}}}}}, "states.day.materials.plaster"),
        (viewed(camera={"name": "free", "position": [2e9, 0, 0], "target": [0, 0, 0]}), "beyond 1e9 m"),
        (viewed(look={"exposure_ev": 100}), "view.look.exposure_ev"),
        (viewed(look={"scale": {"low": 5, "high": 1}}), "is not a luminance range; found 5:1"),
        (viewed(size=[0, 100]), "view.size"),
        (
            {"edited": {"desk": {"document": {"crease_deg": float("inf")}}}},
            "edited.desk.document: a number is not finite",
        ),
    ],
)
def test_a_session_that_cannot_be_read_is_one_line_and_is_kept(window, tmp_path, change, words):
    window.keeper.close()
    text = json.dumps(edited(WalkSession().model_dump(mode="json"), **change))
    (tmp_path / FILE).write_text(text)
    with pytest.raises(UserError) as raised:
        on_disk(tmp_path)
    assert words in str(raised.value) and "\n" not in str(raised.value)
    again = Window(tmp_path)
    again.look_around(THERE)
    again.rest()
    assert len(again.lines) == 1 and words in again.lines[0] and (tmp_path / FILE).read_text() == text
    again.paint(RED)
    again.rest()
    assert (tmp_path / "session-kept-001.json").read_text() == text
    assert on_disk(tmp_path).now.materials == {"plaster": RED}
    again.keeper.close()


def test_a_backup_that_cannot_be_read_is_moved_aside(window, tmp_path):
    window.keeper.close()
    (tmp_path / FORMER_BACKUP).write_text("{")
    again = Window(tmp_path)
    assert len(again.lines) == 1 and "session-unsaved-kept-001.json" in again.lines[0]
    assert (tmp_path / "session-unsaved-kept-001.json").read_text() == "{"
    again.keeper.close()


def test_a_store_that_is_gone_is_said_and_not_made_anew(window, tmp_path):
    window.paint(RED)
    (tmp_path / ".session.lock").unlink()
    tmp_path.rmdir()
    window.rest()
    window.rest()
    said = [text for text in window.said if "store was deleted or moved" in text]
    assert len(said) == 1, "once, although it is tried again"
    assert window.keeper.fault in said and not window.keeper.keeps and window.keeper.unsaved == ("plaster",)
    assert not tmp_path.exists()


def test_a_disk_that_is_full_for_a_while_is_said_until_it_is_not(window, tmp_path, monkeypatch):
    def full(*_):
        raise UserError("cannot be written (No space left on device)", file=tmp_path / FILE)

    window.paint(RED)
    with monkeypatch.context() as context:
        context.setattr("lambent.viewer.edits.session_file.write_session", full)
        window.rest()
        assert "No space left" in window.keeper.fault and window.keeper.unsaved == ("plaster",)
    window.rest()
    assert window.keeper.fault == "" and on_disk(tmp_path).now.materials == {"plaster": RED}


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path, monkeypatch):
    def refused(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("lambent.store.kept.session.os.open", refused)
    opened = Window(tmp_path)
    assert opened.lines == (
        f"read-only: the session cannot be kept: {tmp_path}: cannot be written (Permission denied)",
    )
    opened.paint(RED)
    opened.rest()
    assert opened.keeper.unsaved == ("plaster",) and not opened.keeper.keeps


LOOK = KeptLook(
    exposure_ev=-2.5, base_ev=-3.0, view_transform="false-colour", integrator="rings", show="specular",
    lookups={"table": "plain"}, planar="off", n=7, near_m=0.3, scale=Range(2.0, 90.0),
    noise_scale=Range(1.0, 9.0, False),
)  # fmt: skip
VIEW = KeptView(
    camera=THERE, movement="orbit", flying=True, speed_m_s=2.0, eye_height_m=1.2, size=(400, 300), look=LOOK,
    traces=False, light_follows=False, split=True, selected="table",
)  # fmt: skip


def test_the_view_is_shown_again(state, scene, screen, tmp_path):
    state.session.open()
    restore(state)
    state.materials.edits.compare_with(RoomState())
    assert show_view(state, VIEW) == () and view_of(state) == VIEW
    state.session.close()
    again = WalkState.of(scene, "walk", screen, tmp_path)
    again.session.open()
    assert restore(again) == () and view_of(again) == VIEW
    again.session.close()


def test_a_view_of_another_version_or_store_is_shown_as_far_as_it_goes(state):
    look = LOOK.model_copy(update={"integrator": "photons", "lookups": {"table": "photons", "gone": "plain"}})
    lines = show_view(state, VIEW.model_copy(update={"look": look, "selected": "gone"}))
    assert lines == ("the session's integrator is not known here: photons",)
    assert state.look.integrator == "lamps" and state.look.lookups == {} and state.selection.name is None
    assert state.look.planar == "off" and not state.states.split, "there is no second state"


def test_an_exposure_that_was_not_metered_yet_is_metered_again(state):
    state.meter.expose_wanted = True
    kept = view_of(state)
    assert kept.look.exposure_ev is None
    state.meter.expose_wanted = False
    show_view(state, kept)
    assert state.meter.expose_wanted


def test_numbers_that_no_session_may_have_leave_the_opened_view(state):
    """As the exposure of a picture that is nearly black, or a range of false colours that is empty."""
    state.session.opened = WalkSession(view=VIEW)
    state.look.exposure_ev = 90.0
    assert view_of(state) == VIEW
    state.look.exposure_ev, state.look.scale = 1.0, Range(5.0, 5.0)
    assert view_of(state) == VIEW
    state.look.scale, state.navigation.walker.eye_height_m, state.navigation.walker.speed_m_s = Range(), 0.0, 0.0
    found = view_of(state)
    assert found.look.exposure_ev == 1.0 and found.eye_height_m is None, "a scene without height"


def test_what_could_not_be_read_is_not_written(window, tmp_path):
    window.paint(RED)
    window.rest()
    before = (tmp_path / FILE).read_bytes()
    broken = Material.model_construct(**{**RED.model_dump(), "kd": (float("nan"),) * 3})
    window.paint(broken)
    window.rest()
    assert (tmp_path / FILE).read_bytes() == before and "the session is not kept" in window.keeper.fault
    window.edits.undo()
    window.rest()
    assert window.keeper.fault == ""


def test_a_session_that_is_too_large_is_not_written(window, tmp_path, monkeypatch):
    monkeypatch.setattr("lambent.store.kept.session.SESSION_BYTES", 100)
    window.paint(RED)
    window.rest()
    assert "session is too large" in window.keeper.fault and not (tmp_path / FILE).exists()


def test_orbit_that_was_asked_for_stays(state):
    state.navigation.movement = "orbit"
    show_view(state, VIEW.model_copy(update={"movement": "walk"}))
    assert state.navigation.movement == "orbit"
