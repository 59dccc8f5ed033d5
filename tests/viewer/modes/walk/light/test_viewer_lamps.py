"""The Lamps panel: lamps moved, aimed and exchanged, with undo, in the session, and by the mouse."""

import numpy as np
import pytest

from lambent.scenes.lamp_edits import LampEdit
from lambent.store.kept.session import FILE, RoomState, WalkSession, read_session, write_session
from lambent.store.lamps import LampRecord
from lambent.viewer.modes.walk.light.lamps import aim_of, tilt_and_bearing_deg
from lambent.viewer.modes.walk.markers import projected
from tests.realtime.lamps.test_changed_lamps import IES

PLACE = (0.5, 1.4, 0.0)
SIZE = (1000, 800)


@pytest.fixture
def panels(unfolded, state):
    record = LampRecord(
        number=3, position=PLACE, axes=((1, 0, 0), (0, 0, -1), (0, -1, 0)), intensity=(1, 1, 1), reach_deg=60,
        profile=0, group=0,
    )  # fmt: skip
    state.lamps.records = (record,)
    return unfolded("Lamps")


def mark(state):
    """Where the lamp's mark is, in pixels of the window."""
    place = state.screen.picture
    at, _ = projected(state.navigation.camera, state.lamps.places, (place.width, place.height))
    return place.point(*at[0])


def press(panels, kind, x, y):
    event = {"event_type": f"pointer_{kind}", "x": x, "y": y, "button": 1, "modifiers": ()}
    panels.mode.input.handle(event, ui_has_mouse=False, ui_has_keys=False)


def test_a_drag_of_its_mark_moves_a_lamp_under_the_mouse(panels, state):
    x, y = mark(state)
    camera = state.navigation.camera
    press(panels, "down", x, y)
    for step in range(1, 5):
        press(panels, "move", x + 10 * step, y - 5 * step)
        panels.frame()
    press(panels, "up", x + 40, y - 20)
    panels.frame()
    assert state.lamps.chosen == 3 and state.navigation.camera == camera, "the camera stays"
    np.testing.assert_allclose(mark(state), (x + 40, y - 20), atol=0.1)
    moved = np.array(state.lamps.of(3).position) - PLACE
    forward = np.subtract(camera.target, camera.position)
    assert abs(moved @ forward) < 1e-9 and np.linalg.norm(moved) > 0.05
    state.materials.edits.undo()
    assert not state.materials.edits.room.lamps, "one drag is one step"


def test_a_drag_beside_the_marks_looks_around_and_so_does_one_while_the_panel_is_closed(panels, state):
    x, y = mark(state)
    before = state.navigation.camera
    for begin, close in (((x + 60, y), False), ((x, y), True)):
        if close:
            panels.click("Lamps", 0.3)
            panels.frame(2)
        press(panels, "down", *begin)
        press(panels, "move", begin[0] + 30, begin[1])
        press(panels, "up", begin[0] + 30, begin[1])
        assert state.navigation.camera != before and not state.materials.edits.room.lamps
        before = state.navigation.camera


def test_aim_turns_the_axis_to_the_clicked_point(panels, state):
    state.lamps.chosen = 3
    panels.frame(2)
    panels.click("aim")
    assert state.lamps.aiming
    place, camera = state.screen.picture, state.navigation.camera
    (spot,), _ = projected(camera, np.array([[0.2, 1.0, 0.3]]), (place.width, place.height))  # on the table
    press(panels, "down", *place.point(*spot))
    press(panels, "up", *place.point(*spot))
    aim = np.array(state.lamps.of(3).axis)
    wanted = np.array([0.2, 1.0, 0.3]) - PLACE
    np.testing.assert_allclose(aim, wanted / np.linalg.norm(wanted), atol=0.01)
    assert not state.lamps.aiming and state.selection.name is None
    panels.frame()
    panels.click("reset lamp")
    assert not state.materials.edits.room.lamps


def test_sliders_change_tilt_bearing_and_rotation(panels, state):
    state.lamps.chosen = 3
    panels.frame(2)
    panels.drag("tilt", 0.0, 0.25)
    panels.drag("bearing", 0.5, 0.75)
    panels.drag("rotation", 0.5, 0.25)
    lamp = state.lamps.of(3)
    tilt, bearing = tilt_and_bearing_deg(lamp.aim)
    assert (tilt, bearing) == (pytest.approx(45, abs=4), pytest.approx(90, abs=8))
    assert lamp.rotation_deg == pytest.approx(-90, abs=8) and lamp.position == PLACE
    assert lamp.axis[0] > 0.6, "bearing 90 is +x"


@pytest.mark.parametrize(("tilt", "bearing"), [(0.0, 0.0), (30.0, -120.0), (90.0, 180.0), (180.0, 0.0)])
def test_tilt_and_bearing_are_the_direction(tilt, bearing):
    np.testing.assert_allclose(np.linalg.norm(aim_of(tilt, bearing)), 1.0)
    found_tilt, found_bearing = tilt_and_bearing_deg(aim_of(tilt, bearing))
    assert found_tilt == pytest.approx(tilt)
    assert tilt in (0, 180) or found_bearing == pytest.approx(bearing)


def test_a_dropped_file_becomes_the_chosen_lamps_luminaire(panels, state, tmp_path):
    file, broken = tmp_path / "wide.IES", tmp_path / "broken.ldt"
    file.write_text(IES)
    broken.write_text("no")
    panels.mode.drop(str(file))
    assert (
        "drop it onto a lamp, or choose one" in state.screen.messages[-1].text and not state.materials.edits.room.lamps
    )
    state.lamps.chosen = 3
    panels.mode.drop(str(file))
    assert state.lamps.of(3) == LampEdit(PLACE, (0, -1, 0), 0.0, str(file))
    panels.mode.drop(str(broken))
    assert "luminaire not shown" in state.screen.messages[-1].text and "broken.ldt" in state.screen.messages[-1].text
    assert state.lamps.of(3).file == str(file)
    assert state.session.unsaved == ("the lamps",)


def test_a_file_is_dropped_onto_a_lamp_whose_mark_is_not_shown(panels, state, tmp_path):
    file = tmp_path / "wide.ies"
    file.write_text(IES)
    (x, y), place = mark(state), state.screen.picture
    panels.click("Lamps", 0.3)
    panels.frame(2)
    assert not state.lamps.shown
    state.meter.cursor = ((x + 200 - place.x) / place.width, (y - place.y) / place.height)
    panels.mode.drop(str(file))
    assert state.lamps.chosen is None and "drop it onto a lamp" in state.screen.messages[-1].text
    state.meter.cursor = ((x + 30 - place.x) / place.width, (y - place.y) / place.height)
    panels.mode.drop(str(file))
    assert (
        state.lamps.of(3).file == str(file) and "wide.ies is the luminaire of lamp 4" in state.screen.messages[-1].text
    )


def test_a_session_keeps_lamps_and_reads_files_without_them(tmp_path):
    session = WalkSession(now=RoomState(lamps={3: LampEdit(PLACE, (0, 0, 1), 30.0, "/x.ies")}))
    write_session(tmp_path / FILE, session)
    assert read_session(tmp_path / FILE) == session
    write_session(tmp_path / FILE, WalkSession())
    assert "lamps" not in (tmp_path / FILE).read_text() and read_session(tmp_path / FILE) == WalkSession()


@pytest.mark.parametrize(
    "wrong", ['"position": [0, 1]', '"position": [0, 1, 2], "aim": [0, 0, 0]', '"place": [0, 1, 2]']
)
def test_a_wrong_lamp_of_a_session_is_an_error_in_one_line(tmp_path, wrong):
    from lambent.core.errors import UserError

    text = f'{{"format": "lambent-walk-session", "version": 1, "now": {{"lamps": {{"3": {{{wrong}}}}}}}}}'
    (tmp_path / FILE).write_text(text)
    with pytest.raises(UserError, match="lamps"):
        read_session(tmp_path / FILE)
