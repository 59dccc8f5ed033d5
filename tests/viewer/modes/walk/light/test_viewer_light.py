"""The Light panel, and the mix of light groups in saved views and recorded walks."""

from dataclasses import replace

import pytest

from lambent.core.light.light_mix import GroupMix, LightMix, MixTrack
from lambent.store.kept.views import read_views
from lambent.store.light_groups import LightGroupRecord
from lambent.viewer.cameras.navigation import PathPlay
from lambent.viewer.modes.walk.light.light_keys import key_times, mix_at, with_key, without_key
from lambent.viewer.modes.walk.light.lights import RecordedLight
from lambent.viewer.modes.walk.views.views import SavedViews

GROUPS = (
    LightGroupRecord(name="lamp", members=("bulb_1", "bulb_2"), share=0.25),
    LightGroupRecord(name="sky", members=("sky",), share=0.75),
)
HALF, OFF = LightMix({"lamp": GroupMix(intensity=0.5)}), LightMix({"lamp": GroupMix(on=False)})


@pytest.fixture
def panels(unfolded, state):
    state.lights.groups = GROUPS
    return unfolded("Light")


def test_each_group_is_switched_dimmed_and_tinted(panels, state):
    panels.click("on##lamp", 0.1)
    assert state.lights.mix == OFF and state.recordings.light == {"lamp": (0, 0, 0)}
    panels.drag("##times lamp", 0.25, 0.5)
    lamp = state.lights.mix.of("lamp")
    assert lamp.on and lamp.intensity == pytest.approx(2, abs=0.3), "who moves a slider wants to see it"
    panels.click("K##sky", 0.1)
    panels.frame()
    panels.drag("##kelvin sky", 0.6, 0.2)
    assert state.lights.mix.of("sky").temperature_k == pytest.approx(2600, abs=500)
    panels.click("reset##lamp")
    assert list(state.lights.mix.groups) == ["sky"]
    panels.click("reset all light")
    assert state.lights.mix == LightMix() and state.recordings.light == {}


def test_a_store_without_groups_says_what_to_bake(panels, state):
    state.lights.groups = ()
    panels.frame(2)
    assert "on##lamp" not in panels.rects and "reset all light" not in panels.rects


def saving(state, folder):
    """The state with views that can be saved."""
    state.lights.groups = GROUPS
    state.recordings.views = SavedViews(state.scene, folder)
    return state.recordings


def test_a_saved_view_keeps_its_mix(state, tmp_path):
    recordings = saving(state, tmp_path)
    state.lights.mix = HALF
    recordings.view_name = "evening"
    recordings.save_view()
    assert read_views(tmp_path).lights == {"evening": HALF}
    state.lights.mix = OFF
    recordings.visit(state.scene.cameras[1])
    assert state.lights.mix == OFF, "a camera of the scene has no mix"
    evening = recordings.views.saved.cameras[0]
    recordings.visit(evening)
    assert state.lights.mix == HALF
    state.lights.mix = OFF
    recordings.visit(evening)
    assert state.lights.mix == HALF, "the camera did not move"
    state.lights.edits.undo()
    assert (state.lights.mix, state.navigation.camera) == (OFF, evening)
    assert recordings.views.rename("camera", "evening", "night")
    assert read_views(tmp_path).lights == {"night": HALF}
    assert recordings.views.delete("camera", "night")
    assert '"lights"' not in (tmp_path / "views.json").read_text()


def test_light_is_recorded_with_a_walk_and_followed(state, tmp_path):
    recordings, now = saving(state, tmp_path), [0.0]
    state.screen.clock = lambda: now[0]
    recordings.record()
    for step in range(41):
        now[0] = step * 0.1
        camera = state.navigation.camera
        state.navigation.camera = replace(camera, position=(0.05 * step, 1.6, 3.0))
        state.lights.mix = OFF if step >= 20 else HALF
        recordings.follow()
    recordings.record()
    recordings.save()
    ((name, track),) = read_views(tmp_path).tracks.items()
    assert name == state.navigation.path.path.name
    assert track.factors_at(1.5)["lamp"] == pytest.approx((0.5,) * 3)
    assert track.factors_at(1.95)["lamp"][0] == pytest.approx(0.25, abs=0.05)
    assert track.factors_at(3)["lamp"] == (0, 0, 0)
    state.lights.mix = LightMix()
    path = recordings.views.saved.paths[0]
    state.navigation.path = PathPlay(path, 1.0)
    assert recordings.light["lamp"] == pytest.approx((0.5,) * 3)
    state.navigation.path = None
    assert recordings.light == {}


def test_a_track_of_light_that_never_changed_is_one_key_or_none():
    recorded = RecordedLight()
    for step in range(5):
        recorded.take(LightMix(), step)
    assert recorded.track(0.0) is None
    recorded = RecordedLight()
    for step in range(5):
        recorded.take(HALF, step)
    assert recorded.track(2.0) == MixTrack({"lamp": ((0.0, GroupMix(intensity=0.5)),)})


def test_keys_of_light_are_set_moved_and_removed():
    names = ("lamp", "sky")
    track = with_key(None, 0.0, LightMix(), names)
    assert track.factors_at(0.0) == {} and key_times(track) == (0.0,), "as baked is a key, too"
    track = with_key(track, 2.0, OFF, names)
    assert track.factors_at(1.0) == {"lamp": pytest.approx((0.5,) * 3)}
    assert track.factors_at(5.0) == {"lamp": (0, 0, 0)}
    sky = LightMix({"sky": GroupMix(on=False)})
    assert key_times(with_key(track, 2.02, sky, names)) == (0.0, 2.0), "so near, it takes the other one's place"
    assert mix_at(track, 2.0) == OFF and mix_at(track, 0.0) == LightMix()
    older = MixTrack({"lamp": ((1.0, GroupMix(intensity=0.5)),)})
    assert with_key(older, 3.0, sky, names).factors_at(1.0) == {"lamp": pytest.approx((0.5,) * 3)}
    assert without_key(track, 0.0) == MixTrack({"lamp": ((2.0, GroupMix(on=False)),), "sky": ((2.0, GroupMix()),)})
    assert without_key(without_key(track, 0.0), 2.0) is None and key_times(None) == ()


def test_the_panel_sets_keys_along_a_path(panels, state, tmp_path):
    saving(state, tmp_path)
    state.recordings.views = SavedViews(state.scene, tmp_path)
    path = state.scene.paths[0]
    for time_s, mix in ((0.0, LightMix()), (3.0, OFF)):
        state.navigation.scrub(path, time_s)
        state.recordings.keying = True
        state.lights.mix = mix
        panels.frame(2)
        assert state.recordings.light == mix.factors, "the mix is shown while keys are set"
        panels.click(f"key at {time_s:.1f} s###set key")
    track = read_views(tmp_path).tracks["tour"]
    assert track.factors_at(3.0)["lamp"] == (0, 0, 0) and track.factors_at(0.0) == {}
    panels.click("set keys", 0.05)
    assert not state.recordings.keying and state.recordings.light == {"lamp": (0, 0, 0)}
    state.lights.mix = HALF
    panels.frame(2)
    panels.click("3.0 s##key")
    assert state.lights.mix == OFF and state.recordings.keying
    panels.click("x##key 3.0")
    panels.frame(2)
    panels.click("x##key 0.0")
    panels.frame(2)
    assert "tour" not in read_views(tmp_path).tracks


def test_undo_goes_through_materials_mixes_and_keys_of_light_in_one_order(state, tmp_path):
    """Each step of undo takes the last change back, whatever it was; the file of the walks follows."""
    saving(state, tmp_path)
    state.lights.groups, edits, path = GROUPS, state.materials.edits, state.scene.paths[0]
    state.navigation.scrub(path, 0.0)

    def keys():
        state.recordings.follow()
        return key_times(read_views(tmp_path).tracks.get(path.name))

    name = sorted(state.scene.materials)[0]
    red = state.scene.materials[name].model_copy(update={"kd": (0.6, 0.1, 0.1)})
    edits.set_materials({name: red})
    state.lights.mix = HALF
    edits.end_stroke()
    state.recordings.set_key()
    state.navigation.scrub(path, 1.0)
    state.lights.mix = OFF
    edits.end_stroke()
    state.recordings.set_key()
    assert keys() == (0.0, 1.0)
    edits.undo()
    assert keys() == (0.0,) and state.lights.mix == OFF
    edits.undo()
    assert keys() == (0.0,) and state.lights.mix == HALF
    edits.undo()
    assert keys() == () and state.lights.mix == HALF and edits.edited == {name: red}
    edits.undo()
    edits.undo()
    assert state.lights.mix == LightMix() and not edits.edited and not edits.can_undo
    for _ in range(5):
        edits.redo()
    assert keys() == (0.0, 1.0) and state.lights.mix == OFF
    state.recordings.drop_key(0.0)
    assert keys() == (1.0,)
    edits.undo()
    assert keys() == (0.0, 1.0)
