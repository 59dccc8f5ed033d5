"""The state of the window: edits with undo, selection, messages, saving."""

import errno

import pytest

from lambent.materials.document import load_material
from lambent.viewer.cameras.navigation import Navigation, PathPlay
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.screen import MESSAGE_S


def rougher(material, mx):
    return material.model_copy(update={"lobes": (material.lobes[0].model_copy(update={"mx": mx}),)})


def test_it_starts_at_the_first_camera_with_the_scenes_exposure(state, scene):
    assert state.navigation.camera == scene.cameras[0]
    assert state.look.exposure_ev == 1.5 and not state.meter.expose_wanted


def test_a_scene_without_an_exposure_is_metered_at_its_first_picture(scene, screen):
    state = WalkState.of(scene.model_copy(update={"exposure_ev": None}), "walk", screen)
    assert state.look.exposure_ev == 0 and state.meter.expose_wanted


def test_a_scene_without_cameras_is_seen_whole(scene):
    camera = Navigation.of(scene.model_copy(update={"cameras": ()}), "orbit").camera
    assert camera.target == pytest.approx((0, 1.3, 0))
    assert camera.position[2] > 4


def test_a_stroke_is_undone_as_a_whole(state):
    edits, brass = state.materials.edits, state.scene.materials["brass"]
    for mx in (0.2, 0.25, 0.3):
        edits.change("brass", rougher(brass, mx))
    edits.end_stroke()
    edits.change("brass", rougher(brass, 0.5))
    edits.end_stroke()
    edits.undo()
    assert edits.current("brass").lobes[0].mx == 0.3
    edits.undo()
    assert edits.edited == {} and not edits.can_undo
    edits.redo()
    edits.redo()
    assert edits.current("brass").lobes[0].mx == 0.5 and not edits.can_redo


def test_edits_handed_out_stay_as_they_were(state):
    """A frame and a step of undo hold the same mapping, so that no later change may reach into it."""
    edits, brass = state.materials.edits, state.scene.materials["brass"]
    edits.change("brass", rougher(brass, 0.2))
    handed_out = edits.edited
    edits.change("brass", rougher(brass, 0.4))
    assert handed_out["brass"].lobes[0].mx == 0.2
    assert edits.previous("brass") == brass


def test_a_stroke_that_ends_where_it_began_is_none(state):
    state.materials.edits.change("brass", rougher(state.scene.materials["brass"], 0.2))
    state.materials.edits.change("brass", state.scene.materials["brass"])
    state.materials.edits.end_stroke()
    assert not state.materials.edits.can_undo


def test_moving_the_camera_ends_the_path(state, scene):
    state.navigation.path = PathPlay(scene.paths[0])
    state.navigation.move(state.navigation.camera)
    assert state.navigation.path is not None
    state.navigation.move(scene.cameras[1])
    assert state.navigation.path is None and state.navigation.camera == scene.cameras[1]


def test_messages_go(state):
    state.screen.say("hello")
    state.screen.drop_old_messages()
    assert [m.text for m in state.screen.messages] == ["hello"]
    state.screen.clock.now_s = MESSAGE_S
    state.screen.drop_old_messages()
    assert state.screen.messages == []


@pytest.mark.parametrize("name", ["../brass.json", "brass", ".json", "/tmp/brass.json", ""])
def test_a_material_is_saved_nowhere_else(state, tmp_path, name):
    state.materials.file_names["brass"] = name
    state.materials.save("brass")
    assert "not saved" in state.screen.messages[-1].text
    assert list(tmp_path.iterdir()) == []


def test_a_file_name_is_offered_for_any_material(state):
    assert state.materials.file_name("brass") == "brass.json"
    assert state.materials.file_name("../a/b:c") == "_a_b_c.json"
    assert state.materials.file_name("...") == "material.json"


def test_a_path_plays_to_its_end_and_again(state, scene):
    tour = scene.paths[0]
    state.navigation.toggle(tour)
    state.navigation.play(1.0)
    assert state.navigation.playing and state.navigation.camera.position not in (
        tour.keys[0].position,
        tour.keys[1].position,
    )
    state.navigation.toggle(tour)
    before = state.navigation.camera
    state.navigation.play(1.0)
    assert state.navigation.camera == before
    state.navigation.toggle(tour)
    state.navigation.play(99.0)
    assert not state.navigation.playing and state.navigation.camera.position == pytest.approx(tour.keys[1].position)
    state.navigation.toggle(tour)
    assert state.navigation.playing and state.navigation.path.time_s == 0


def test_unsaved_materials_are_known_and_rescued(state, tmp_path):
    assert state.unsaved_materials == ()
    state.materials.edits.change("brass", rougher(state.scene.materials["brass"], 0.2))
    state.materials.edits.end_stroke()
    assert state.unsaved_materials == ("brass",)
    state.materials.save("brass")
    assert state.unsaved_materials == ()
    state.materials.edits.change("brass", rougher(state.scene.materials["brass"], 0.4))
    assert state.unsaved_materials == ("brass",)
    (path,) = state.materials.rescue(state.unsaved_materials)
    assert path == tmp_path / "brass-rescued-001.json" and load_material(path).lobes[0].mx == 0.4
    state.materials.edits.undo()
    state.materials.edits.reset("brass")
    assert state.unsaved_materials == ()


def test_a_material_that_was_changed_by_hand_says_so(state, tmp_path):
    state.materials.save("brass")
    assert load_material(tmp_path / "brass.json").provenance == state.scene.materials["brass"].provenance
    state.materials.edits.change("brass", rougher(state.scene.materials["brass"], 0.2))
    state.materials.save("brass")
    assert load_material(tmp_path / "brass.json").provenance.notes == ("edited by hand",)


def test_who_grows_is_lifted(state):
    before = state.navigation.camera
    state.navigation.set_eye_height(state.navigation.walker.eye_height_m + 0.3)
    assert state.navigation.camera.position[1] == pytest.approx(before.position[1] + 0.3)
    state.navigation.flying = True
    state.navigation.set_eye_height(1.0)
    assert state.navigation.camera.position[1] == pytest.approx(before.position[1] + 0.3)
    state.navigation.set_fov(20.0)
    assert state.navigation.camera.fov_y_deg == 20


def test_a_material_that_cannot_be_written_is_said_by_its_name(state, monkeypatch):
    def refused(*_, **__):
        raise PermissionError(errno.EACCES, "Permission denied", ".lambent-x1.json")

    monkeypatch.setattr("os.open", refused)
    state.materials.save("brass")
    said = state.screen.messages[-1].text
    assert said == f"not saved: {state.screen.folder / 'brass.json'}: cannot be written (Permission denied)"
    assert "brass" not in state.materials.edits.saved
