"""Recorded walks and saved views: what is kept of a walk, and what is refused."""

import numpy as np
import pytest

from lambent.core.views.camera import Camera, CameraPath
from lambent.scenes.camera_paths import camera_at
from lambent.store.kept.views import read_views
from lambent.viewer.modes.walk.views.recording import KEY_S, Recording, smoothed
from lambent.viewer.modes.walk.views.views import SavedViews


def at(x):
    return Camera(name="free", position=(x, 1.6, 0), target=(x, 1.6, -1))


def walked(seconds, waited_s=0.0, jitter=0.0):
    recording, rng = Recording(), np.random.default_rng(1)
    for time_s in np.arange(0.0, waited_s + 0.01, 0.1):
        recording.take(at(0.0), time_s)
    for k in range(1, round(30 * seconds) + 1):
        recording.take(at(k / 30 + jitter * rng.normal()), waited_s + k / 30)
    return recording


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


def test_slow_frames_are_no_standstill():
    """A frame takes a fifth of a second while the picture refines: the walk is steady all the same."""
    recording = Recording()
    for k in range(8):
        recording.take(at(0.2 * k), 0.2 * k)
    path = recording.path("w", smooth_s=0.0)
    for time_s in np.linspace(0, 1.4, 29):
        assert camera_at(path, time_s).position[0] == pytest.approx(time_s, abs=1e-6)


def test_a_single_step_is_a_walk():
    recording = Recording()
    for time_s in (0.0, 0.1, 5.0):
        recording.take(at(0.0), time_s)
    recording.take(at(0.07), 5.05)
    path = recording.path("w")
    assert path.seconds == pytest.approx(0.05) and path.keys[-1].position[0] == pytest.approx(0.07)
    assert camera_at(path, path.seconds).position == path.keys[-1].position


def test_when_the_camera_rested_is_known_to_the_frame():
    recording = Recording()
    for time_s, x in ((0.0, 0), (0.1, 0.1), (0.2, 0.2), (0.3, 0.2), (0.4, 0.2), (0.45, 0.25), (0.5, 0.3)):
        recording.take(at(x), time_s)
    path = recording.path("w", smooth_s=0.0)
    assert camera_at(path, 0.4).position[0] == pytest.approx(0.2, abs=1e-6)


def test_sight_and_angle_of_view_are_recorded():
    """Turning in place while the angle of view grows from 40 to 80 degrees."""
    recording = Recording()
    for k in range(61):
        target = (np.sin(k / 60), 1.6 + k / 60, -np.cos(k / 60))
        recording.take(Camera("free", (0.0, 1.6, 0.0), target, fov_y_deg=40 + k * 40 / 60), k / 30)
    middle = camera_at(recording.path("w", smooth_s=0.0), 1.0)
    assert middle.fov_y_deg == pytest.approx(60, abs=0.1)
    assert middle.target == pytest.approx((np.sin(0.5), 2.1, -np.cos(0.5)), abs=1e-3)
    assert middle.position == pytest.approx((0, 1.6, 0))


def test_smoothing_takes_jerks_out_and_leaves_the_ends():
    rough, smooth = (walked(6.0, jitter=0.05).path("w", s) for s in (0.0, 0.5))
    jerk = [np.abs(np.diff([k.position[0] for k in p.keys], n=2)).max() for p in (rough, smooth)]
    assert jerk[1] < 0.2 * jerk[0]
    assert smooth.keys[0].position == pytest.approx(rough.keys[0].position)
    assert smooth.keys[-1].position == pytest.approx(rough.keys[-1].position)
    line = np.outer(np.arange(30.0), [1.0, -2.0]) + 5
    np.testing.assert_allclose(smoothed(line, 4.0), line, atol=1e-9)
    assert smoothed(line[:2], 50.0).shape == (2, 2)


def test_record_save_rename_delete(state, tmp_path):
    state.recordings.record()
    for k in range(1, 20):
        state.screen.clock.now_s = 0.1 * k
        state.navigation.camera = at(0.1 * k)
        assert not state.recordings.recorder.take(state.navigation.camera, state.screen.clock.now_s)
    state.recordings.record()
    assert state.navigation.path.path == state.recordings.recorder.draft in state.recordings.paths
    state.navigation.toggle(state.recordings.recorder.draft)
    assert state.navigation.playing and state.navigation.path.time_s == 0
    before = state.recordings.recorder.draft
    state.recordings.recorder.smooth(1.5)
    assert state.recordings.recorder.draft != before
    for name, word in (("", "name is empty"), ("tour", "name is already used"), ("a\tb", "name cannot be used")):
        state.recordings.recorder.name = name
        state.recordings.save()
        assert word in state.screen.messages[-1].text and state.recordings.recorder.draft is not None
    state.recordings.recorder.name = " up/down "
    state.recordings.save()
    assert state.recordings.recorder.draft is None and state.navigation.path.path.name == "up/down"
    assert [p.name for p in read_views(tmp_path).paths] == ["up/down"]
    assert state.recordings.views.rename("path", "up/down", "there") and not state.recordings.views.rename(
        "path", "there", "tour"
    )
    assert [p.name for p in state.recordings.paths] == ["tour", "there"]
    assert state.recordings.views.delete("path", "there") and read_views(tmp_path).paths == ()


@pytest.mark.parametrize("stopped", [True, False])
def test_a_recording_is_kept_when_the_window_closes(state, tmp_path, stopped):
    assert state.recordings.keep() is None
    state.recordings.record()
    for k in range(1, 20):
        state.screen.clock.now_s, state.navigation.camera = 0.1 * k, at(0.1 * k)
        state.recordings.recorder.take(state.navigation.camera, state.screen.clock.now_s)
    if stopped:
        state.recordings.record()
        state.recordings.recorder.name = "tour"  # taken
    name = state.recordings.keep()
    assert name == "walk 1" and [p.name for p in read_views(tmp_path).paths] == [name]


def test_a_recording_ends_by_itself(state):
    state.recordings.record()
    assert not state.recordings.recorder.take(at(1), 1.0)
    assert state.recordings.recorder.take(at(2), 601.0)


def test_standing_still_records_nothing(state):
    state.recordings.record()
    state.recordings.record()
    assert "did not move" in state.screen.messages[-1].text and state.recordings.recorder.draft is None


def test_views_are_saved_renamed_and_deleted(state, tmp_path):
    state.navigation.move(at(7))
    state.recordings.save_view()
    state.recordings.view_name = "front"
    state.recordings.save_view()
    assert "name is already used" in state.screen.messages[-1].text
    state.recordings.view_name = "door"
    state.recordings.save_view()
    assert [c.name for c in state.recordings.cameras] == ["front", "side", "view 1", "door"]
    assert state.navigation.camera == state.recordings.cameras[-1] and state.recordings.view_name == ""
    assert state.recordings.views.rename("camera", "door", "gate") and state.recordings.views.rename(
        "camera", "gate", "gate"
    )
    assert not state.recordings.views.rename("camera", "gate", "view 1")
    assert state.recordings.views.delete("camera", "view 1")
    again = SavedViews(state.scene, tmp_path)
    again.load()
    assert [c.name for c in again.saved.cameras] == ["gate"]


def test_a_damaged_file_is_said_and_kept(state, tmp_path):
    (tmp_path / "views.json").write_text("{")
    state.recordings.views.load()
    state.recordings.save_view()
    assert "views.json" in state.screen.messages[0].text and "not saved" in state.screen.messages[1].text
    assert (tmp_path / "views.json").read_text() == "{"


def test_two_windows_name_what_they_save_beside_each_other(state, tmp_path):
    other = SavedViews(state.scene, tmp_path)
    other.add(at(3))
    other.add(CameraPath(name="", keys=(at(0), at(1)), seconds=1.0, times_s=(0.0, 1.0)))
    state.recordings.record()
    for k in range(1, 20):
        state.screen.clock.now_s, state.navigation.camera = 0.1 * k, at(0.1 * k)
        state.recordings.recorder.take(state.navigation.camera, state.screen.clock.now_s)
    state.recordings.record()
    state.recordings.save_view()
    state.recordings.save()
    assert [m.text for m in state.screen.messages[-2:]] == ["saved the view view 2", "saved the path walk 2"]
    other.add(at(4), "gate")
    state.recordings.view_name = "gate"
    state.recordings.save_view()
    assert "name is already used" in state.screen.messages[-1].text and state.recordings.cameras[-1].name == "gate", (
        "and is shown"
    )


def test_what_another_window_deleted_cannot_be_renamed(state, tmp_path):
    way = CameraPath(name="", keys=(at(0), at(1)), seconds=1.0, times_s=(0.0, 1.0))
    state.recordings.views.add(way, "walk 1")
    state.recordings.views.add(at(0), "door")
    other = SavedViews(state.scene, tmp_path)
    assert other.delete("path", "walk 1") and other.delete("camera", "door")
    assert not state.recordings.views.rename("path", "walk 1", "there") and "walk 1" in state.screen.messages[-1].text
    assert not state.recordings.views.rename("camera", "door", "gate") and "door" in state.screen.messages[-1].text
    assert [p.name for p in state.recordings.paths] == ["tour"] and [c.name for c in state.recordings.cameras] == [
        "front",
        "side",
    ]
