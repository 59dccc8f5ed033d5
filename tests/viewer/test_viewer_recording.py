"""Recorded walks and saved views: what is kept of a walk, and what is refused."""

import numpy as np
import pytest

from lambent.core.camera import Camera, CameraPath
from lambent.scenes.camera_paths import camera_at
from lambent.store.views import read_views
from lambent.viewer.recording import KEY_S, Recording, smoothed
from lambent.viewer.state import ViewerState
from lambent.viewer.views import SavedViews


def at(x):
    return Camera(name="free", position=(x, 1.6, 0), target=(x, 1.6, -1))


def walked(seconds, waited_s=0.0, jitter=0.0):
    recording, rng = Recording(), np.random.default_rng(1)
    recording.take(at(0.0), 0.0)
    for k in range(1, round(30 * seconds) + 1):
        recording.take(at(k / 30 + jitter * rng.normal()), waited_s + k / 30)
    return recording


@pytest.fixture
def state(scene, choices, tmp_path):
    state = ViewerState.of(scene, choices, "walk", folder=tmp_path)
    state.views = SavedViews(scene, tmp_path, state.say)
    state.now_s = 0.0
    state.clock = lambda: state.now_s
    return state


def test_a_steady_walk_comes_out_as_it_was():
    path = walked(4.0).path("w")
    assert path.seconds == pytest.approx(4.0) and len(path.keys) == 41
    assert path.times_s[1] == pytest.approx(KEY_S)
    for time_s in (0.0, 0.33, 2.0, 3.7, 4.0):
        assert camera_at(path, time_s).position == pytest.approx((time_s, 1.6, 0), abs=1e-6)


def test_waiting_before_the_first_step_is_left_out_and_standing_still_is_kept():
    recording = walked(2.0, waited_s=5.0)
    assert recording.seconds == pytest.approx(2.0, abs=0.1)
    recording.take(at(3.0), 12.0)  # nothing was drawn for five seconds
    path = recording.path("w", smooth_s=0.0)
    assert path.seconds == pytest.approx(7.0, abs=0.1)
    assert camera_at(path, 5.0).position[0] == pytest.approx(2.0, abs=1e-3)


def test_smoothing_takes_jerks_out_and_leaves_the_ends():
    rough, smooth = (walked(6.0, jitter=0.05).path("w", s) for s in (0.0, 0.5))
    jerk = [np.abs(np.diff([k.position[0] for k in p.keys], n=2)).max() for p in (rough, smooth)]
    assert jerk[1] < 0.2 * jerk[0]
    assert smooth.keys[0].position == pytest.approx(rough.keys[0].position)
    assert smooth.keys[-1].position == pytest.approx(rough.keys[-1].position)
    line = np.outer(np.arange(30.0), [1.0, -2.0]) + 5
    np.testing.assert_allclose(smoothed(line, 4.0), line, atol=1e-9)
    assert smoothed(line[:2], 50.0).shape == (2, 2)


def test_nothing_moved_is_no_path():
    recording = Recording()
    assert recording.path("w") is None
    recording.take(at(0), 0.0)
    recording.take(at(0), 9.0)
    assert recording.path("w") is None


def test_record_save_rename_delete(state, tmp_path):
    state.record()
    for k in range(1, 20):
        state.now_s = 0.1 * k
        state.camera = at(0.1 * k)
        assert not state.recorder.take(state.camera, state.now_s)
    state.record()
    assert state.path.path == state.recorder.draft in state.paths
    state.toggle(state.recorder.draft)
    assert state.playing and state.path.time_s == 0
    before = state.recorder.draft
    state.recorder.smooth(1.5)
    assert state.recorder.draft != before
    for name, word in (("", "a name is missing"), ("tour", "the name is taken"), ("a\tb", "not a name")):
        state.recorder.name = name
        state.save_recording()
        assert word in state.messages[-1].text and state.recorder.draft is not None
    state.recorder.name = " up/down "
    state.save_recording()
    assert state.recorder.draft is None and state.path.path.name == "up/down"
    assert [p.name for p in read_views(tmp_path).paths] == ["up/down"]
    assert state.views.rename_path("up/down", "there") and not state.views.rename_path("there", "tour")
    assert [p.name for p in state.paths] == ["tour", "there"]
    assert state.views.delete_path("there") and read_views(tmp_path).paths == ()


@pytest.mark.parametrize("stopped", [True, False])
def test_a_recording_is_kept_when_the_window_closes(state, tmp_path, stopped):
    assert state.keep_recording() is None
    state.record()
    for k in range(1, 20):
        state.now_s, state.camera = 0.1 * k, at(0.1 * k)
        state.recorder.take(state.camera, state.now_s)
    if stopped:
        state.record()
        state.recorder.name = "tour"  # taken
    name = state.keep_recording()
    assert name == "walk 1" and [p.name for p in read_views(tmp_path).paths] == [name]


def test_a_recording_ends_by_itself(state):
    state.record()
    assert not state.recorder.take(at(1), 1.0)
    assert state.recorder.take(at(2), 601.0)


def test_standing_still_records_nothing(state):
    state.record()
    state.record()
    assert "did not move" in state.messages[-1].text and state.recorder.draft is None


def test_views_are_saved_renamed_and_deleted(state, tmp_path):
    state.move(at(7))
    state.save_view()
    state.view_name = "front"
    state.save_view()
    assert "the name is taken" in state.messages[-1].text
    state.view_name = "door"
    state.save_view()
    assert [c.name for c in state.cameras] == ["front", "side", "view 1", "door"]
    assert state.camera == state.cameras[-1] and state.view_name == ""
    assert state.views.rename_camera("door", "gate") and state.views.rename_camera("gate", "gate")
    assert not state.views.rename_camera("gate", "view 1")
    assert state.views.delete_camera("view 1")
    again = SavedViews(state.scene, tmp_path)
    again.load()
    assert [c.name for c in again.cameras] == ["gate"]


def test_a_damaged_file_is_said_and_kept(state, tmp_path):
    (tmp_path / "views.json").write_text("{")
    state.views.load()
    state.save_view()
    assert "views.json" in state.messages[0].text and "not saved" in state.messages[1].text
    assert (tmp_path / "views.json").read_text() == "{"


def test_two_windows_do_not_lose_views(state, tmp_path):
    other = SavedViews(state.scene, tmp_path)
    other.load()
    state.save_view()
    other.add_camera(at(3), "other")
    assert [c.name for c in read_views(tmp_path).cameras] == ["view 1", "other"]


def test_two_windows_name_what_they_save_beside_each_other(state, tmp_path):
    other = SavedViews(state.scene, tmp_path)
    other.add_camera(at(3))
    other.add_path(CameraPath(name="", keys=(at(0), at(1)), seconds=1.0, times_s=(0.0, 1.0)))
    state.record()
    for k in range(1, 20):
        state.now_s, state.camera = 0.1 * k, at(0.1 * k)
        state.recorder.take(state.camera, state.now_s)
    state.record()
    state.save_view()
    state.save_recording()
    assert [m.text for m in state.messages[-2:]] == ["saved the view view 2", "saved the path walk 2"]
    other.add_camera(at(4), "gate")
    state.view_name = "gate"
    state.save_view()
    assert "the name is taken" in state.messages[-1].text and state.cameras[-1].name == "gate", "and is shown"


def test_what_another_window_deleted_cannot_be_renamed(state, tmp_path):
    way = CameraPath(name="", keys=(at(0), at(1)), seconds=1.0, times_s=(0.0, 1.0))
    state.views.add_path(way, "walk 1")
    state.views.add_camera(at(0), "door")
    other = SavedViews(state.scene, tmp_path)
    assert other.delete_path("walk 1") and other.delete_camera("door")
    assert not state.views.rename_path("walk 1", "there") and "walk 1" in state.messages[-1].text
    assert not state.views.rename_camera("door", "gate") and "door" in state.messages[-1].text
    assert [p.name for p in state.paths] == ["tour"] and [c.name for c in state.cameras] == ["front", "side"]
