"""The room and one of its views, edited in place, in one window: camera, selection, light and edits stay."""

from dataclasses import replace

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.light.light_mix import GroupMix, LightMix
from lambent.core.pictures.images import write_image
from lambent.store.kept.session import FILE, RelitSky, read_session
from lambent.store.kept.views import read_views
from lambent.viewer.modes.edit import start
from lambent.viewer.modes.edit.mode import EditMode
from lambent.viewer.modes.relight.mode import RelightMode
from lambent.viewer.modes.walk.mode import WalkMode, open_store
from lambent.viewer.modes.walk.session.leaving import edit_view, relight_view
from tests.viewer.drawn_frames import drawn
from tests.viewer.edited_view import pull

BLUE = (0.1, 0.1, 0.6)


@pytest.fixture
def mode(adapter, baked_box, screen):
    """The room on foot, after an edit, away from its cameras; what is open at the end is closed."""
    for name in (FILE, "views.json"):
        (baked_box / name).unlink(missing_ok=True)
    opened = open_store(baked_box, "walk", screen)
    state = opened.state
    edits = state.materials.edits
    edits.change("red", edits.scene["red"].model_copy(update={"kd": BLUE}))
    edits.end_stroke()
    state.navigation.camera = replace(state.navigation.camera, name="free", position=(0.1, 0.5, 2.2))
    state.selection.choose("left")
    state.look.exposure_ev, state.meter.expose_wanted = -1.0, False
    found = [opened]
    yield found
    found[-1].drawing.close()
    found[-1].close()


def enter(found):
    """The mode that the window enters, in place of the present one."""
    wanted, found[-1].screen.enter = found[-1].screen.enter, None
    found.append(wanted(found[-1]))
    return found[-1]


def test_there_and_back(mode, baked_box):
    walk = mode[0]
    edit_view(walk.state)
    view = enter(mode)
    assert isinstance(view, EditMode) and view.drawing.device is walk.drawing.device
    document = view.state.session.document
    assert document.camera == read_views(baked_box).cameras[0] and document.camera.position == (0.1, 0.5, 2.2)
    width, height = document.size
    assert width / height == pytest.approx(4 / 3, rel=0.01) and 0.98 < width * height / 512**2 < 1.02
    assert view.state.material == "red" and view.state.look.exposure_ev == -1.0
    assert document.materials["red"].now.kd == BLUE
    pull(view.state.session, "red", "diffuse", 0.5)
    pulled = view.state.session.material("red").now
    view.state.enter_room()
    back = enter(mode)
    assert isinstance(back, WalkMode) and back.state.navigation.camera == document.camera
    assert back.state.selection.name == "left" and back.state.look.exposure_ev == -1.0
    drawn(back.drawing, back.state, (32, 24))
    assert back.drawing._a.read().mean() > 0
    edits = back.state.materials.edits
    assert edits.current("red") == pulled
    edits.undo()
    assert edits.current("red").kd == BLUE
    edits.undo()
    assert "red" not in edits.edited, "one history before and after"
    edits.redo()
    edits.redo()
    edit_view(back.state)
    again = enter(mode)
    assert len(read_views(baked_box).cameras) == 1, "the view is a camera already"
    session = again.state.session
    assert session.material("red").now == pulled and session.document.size == (width, height)
    session.undo()
    assert session.material("red").now.kd == BLUE, "and in the view"


def test_a_window_that_began_with_a_view_enters_the_room(adapter, mode, baked_box, screen):
    mode[0].close()
    mode.append(start(baked_box, "edit", screen, camera="front"))
    mode[-1].state.enter_room()
    back = enter(mode)
    drawn(back.drawing, back.state, (32, 24))
    assert isinstance(back, WalkMode) and back.drawing._a.read().mean() > 0
    assert back.state.navigation.camera.name == "front"


def test_a_view_is_relit_and_left(mode, baked_box, monkeypatch, tmp_path):
    monkeypatch.setattr("lambent.viewer.modes.relight.state.ViewBake", lambda *_: Bake())
    write_image(tmp_path / "sky.exr", np.ones((4, 8, 3), np.float32))
    relight_view(mode[0].state, tmp_path / "sky.exr")
    view = enter(mode)
    assert isinstance(view, RelightMode) and view.drawing.device is mode[0].drawing.device
    state = view.state
    assert state.edits.sky.environment.file.endswith("sky.exr") and state.look.exposure_ev == -1.0
    assert state.view.camera == read_views(baked_box).cameras[0] and state.edits.current("red").kd == BLUE
    assert state.size[0] / state.size[1] == pytest.approx(4 / 3, rel=0.01)
    state.turn(30.0)
    state.look.expose(-2.0)
    state.enter_room()
    back = enter(mode)
    assert isinstance(back, WalkMode) and back.state.navigation.camera == state.view.camera
    assert back.state.selection.name == "left" and back.state.look.exposure_ev == -2.0
    edits = back.state.materials.edits
    for sky in (("sky.exr", 30.0), ("sky.exr", 0.0)):
        assert edits.sky.environment.file.endswith(sky[0]) and edits.sky.turn_deg == sky[1]
        edits.undo()
    assert edits.sky == RelitSky() and edits.current("red").kd == BLUE
    edits.undo()
    assert "red" not in edits.edited and not edits.can_undo, "one history"


class Bake:
    """A bake that takes for ever."""

    running, line, error = True, "baking by hand", ""

    def close(self):
        self.running = False


def test_a_room_that_is_shown_afresh_stays_fresh_in_its_views(mode, baked_box, screen):
    mode[0].drawing.close()
    mode[0].close()
    before = (baked_box / FILE).read_bytes()
    mode.append(open_store(baked_box, "walk", screen, fresh=True))
    edit_view(mode[-1].state)
    assert enter(mode).state.subject.edits.edited == {}, "as it was left"
    kept = baked_box / "session-kept-001.json"
    assert kept.read_bytes() == before and "red" in read_session(kept).now.materials
    kept.unlink()


def test_a_view_that_cannot_be_edited_leaves_the_window_in_the_room(mode, monkeypatch):
    def refused(*_, **__):
        raise UserError("the scene is gone", file="scene.toml")

    monkeypatch.setattr("lambent.viewer.modes.edit.start", refused)
    edit_view(mode[0].state)
    back = enter(mode)
    assert isinstance(back, WalkMode) and back is not mode[0] and back.state.selection.name == "left"
    assert "edit: scene.toml: the scene is gone" in back.screen.messages[-1].text


def test_what_would_be_lost_keeps_the_window_in_the_room(mode):
    state = mode[0].state
    state.recordings.record()
    for k in range(10):
        state.navigation.camera = replace(state.navigation.camera, position=(0.1 * k, 0.5, 2.0))
        state.recordings.recorder.take(state.navigation.camera, 0.1 * k)
    edit_view(state)
    assert state.screen.enter is None and "the recorded walk" in state.screen.messages[-1].text
    state.recordings.drop()


def test_a_view_says_what_of_the_room_it_does_not_show(mode):
    state = mode[0].state
    state.materials.edits.mix(LightMix({"lamp": GroupMix(intensity=0.5)}))
    edit_view(state)
    assert enter(mode).state.subject.lines == ("shown as baked here: the room's light mix",)


def test_a_view_starts_from_the_scene_where_the_room_is_as_baked(mode):
    mode[0].state.materials.edits.undo()
    edit_view(mode[0].state)
    view = enter(mode)
    of_scene = view.state.subject.scene.materials["red"]
    assert view.state.session.material("red").now == of_scene


@pytest.mark.long
def test_a_window_enters_a_view_and_returns(open_window, baked_box, tmp_path):
    for name in (FILE, "views.json"):
        (baked_box / name).unlink(missing_ok=True)
    window = open_window(baked_box, tmp_path, (1000, 700))
    before = window.state()["camera"]
    window.click(*window.point("edit this view"))
    window.wait_for(lambda state: "trouble" in state)
    window.settle()
    window.click(*window.point("walk from here"))
    seen = window.wait_for(lambda state: "trouble" not in state)
    assert seen["camera"] == before
    window.settle()
    assert window.close() == 0
    assert read_session(baked_box / FILE).view.camera.name == before["name"]
