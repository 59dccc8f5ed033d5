"""The state of the window: edits with undo, selection, messages, saving."""

import errno

import pytest

from lambent.materials.document import load_material
from lambent.viewer.state import MESSAGE_S, PathPlay, ViewerState


@pytest.fixture
def state(scene, choices, tmp_path):
    return ViewerState.of(scene, choices, "walk", folder=tmp_path)


def rougher(material, mx):
    return material.model_copy(update={"lobes": (material.lobes[0].model_copy(update={"mx": mx}),)})


def test_it_starts_at_the_first_camera_with_the_scenes_exposure(state, scene):
    assert state.camera == scene.cameras[0]
    assert state.exposure_ev == 1.5


def test_a_scene_without_cameras_is_seen_whole(scene, choices):
    camera = ViewerState.of(scene.model_copy(update={"cameras": ()}), choices, "orbit").camera
    assert camera.target == pytest.approx((0, 1.3, 0))
    assert camera.position[2] > 4


def test_a_stroke_is_undone_as_a_whole(state):
    edits, brass = state.edits, state.scene.materials["brass"]
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


def test_a_new_stroke_forgets_what_was_undone(state):
    edits, brass = state.edits, state.scene.materials["brass"]
    edits.change("brass", rougher(brass, 0.2))
    edits.undo()
    edits.change("brass", rougher(brass, 0.4))
    edits.end_stroke()
    assert not edits.can_redo
    edits.redo()
    assert edits.current("brass").lobes[0].mx == 0.4


def test_a_stroke_that_ends_where_it_began_is_none(state):
    state.edits.change("brass", rougher(state.scene.materials["brass"], 0.2))
    state.edits.change("brass", state.scene.materials["brass"])
    state.edits.end_stroke()
    assert not state.edits.can_undo


def test_reset_can_be_undone(state):
    edited = rougher(state.scene.materials["brass"], 0.2)
    state.edits.change("brass", edited)
    state.edits.reset("brass")
    assert state.edits.current("brass") == state.scene.materials["brass"]
    state.edits.undo()
    assert state.edits.current("brass") == edited


def test_selection_leads_to_the_material(state):
    assert state.selected_material is None
    state.selected = "table"
    assert state.selected_material == "brass"


def test_moving_the_camera_ends_the_path(state, scene):
    state.path = PathPlay(scene.paths[0])
    state.move(state.camera)
    assert state.path is not None
    state.move(scene.cameras[1])
    assert state.path is None and state.camera == scene.cameras[1]


def test_messages_go(state):
    now = [0.0]
    state.clock = lambda: now[0]
    state.say("hello")
    state.drop_old_messages()
    assert [m.text for m in state.messages] == ["hello"]
    now[0] = MESSAGE_S
    state.drop_old_messages()
    assert state.messages == []


def test_a_material_is_saved_as_it_is_now(state, tmp_path):
    edited = rougher(state.scene.materials["brass"], 0.2)
    state.edits.change("brass", edited)
    state.file_names["brass"] = "new brass.json"
    state.save_material("brass")
    saved = load_material(tmp_path / "new brass.json")
    assert saved.lobes == edited.lobes and saved.kd == edited.kd
    assert state.messages[-1].text == "saved new brass.json"


@pytest.mark.parametrize("name", ["../brass.json", "brass", ".json", "/tmp/brass.json", ""])
def test_a_material_is_saved_nowhere_else(state, tmp_path, name):
    state.file_names["brass"] = name
    state.save_material("brass")
    assert "not saved" in state.messages[-1].text
    assert list(tmp_path.iterdir()) == []


def test_a_file_name_is_offered_for_any_material(state):
    assert state.file_name("brass") == "brass.json"
    assert state.file_name("../a/b:c") == "_a_b_c.json"
    assert state.file_name("...") == "material.json"


def test_a_path_plays_to_its_end_and_again(state, scene):
    tour = scene.paths[0]
    state.toggle(tour)
    state.play(1.0)
    assert state.playing and state.camera.position not in (tour.keys[0].position, tour.keys[1].position)
    state.toggle(tour)
    before = state.camera
    state.play(1.0)
    assert state.camera == before
    state.toggle(tour)
    state.play(99.0)
    assert not state.playing and state.camera.position == pytest.approx(tour.keys[1].position)
    state.toggle(tour)
    assert state.playing and state.path.time_s == 0


def test_unsaved_materials_are_known_and_rescued(state, tmp_path):
    assert state.unsaved == ()
    state.edits.change("brass", rougher(state.scene.materials["brass"], 0.2))
    state.edits.end_stroke()
    assert state.unsaved == ("brass",)
    state.save_material("brass")
    assert state.unsaved == ()
    state.edits.change("brass", rougher(state.scene.materials["brass"], 0.4))
    assert state.unsaved == ("brass",)
    (path,) = state.rescue_materials()
    assert path == tmp_path / "brass-rescued-001.json" and load_material(path).lobes[0].mx == 0.4
    state.edits.undo()
    state.edits.reset("brass")
    assert state.unsaved == ()


def test_a_material_that_was_changed_by_hand_says_so(state, tmp_path):
    state.save_material("brass")
    assert load_material(tmp_path / "brass.json").provenance == state.scene.materials["brass"].provenance
    state.edits.change("brass", rougher(state.scene.materials["brass"], 0.2))
    state.save_material("brass")
    assert load_material(tmp_path / "brass.json").provenance.notes == ("edited by hand",)


def test_who_grows_is_lifted(state):
    before = state.camera
    state.set_eye_height(state.walker.eye_height_m + 0.3)
    assert state.camera.position[1] == pytest.approx(before.position[1] + 0.3)
    state.flying = True
    state.set_eye_height(1.0)
    assert state.camera.position[1] == pytest.approx(before.position[1] + 0.3)
    state.set_fov(20.0)
    assert state.camera.fov_y_deg == 20


def test_a_material_that_cannot_be_written_is_said_by_its_name(state, monkeypatch):
    def refused(*_, **__):
        raise PermissionError(errno.EACCES, "Permission denied", ".brass.x1.json")

    monkeypatch.setattr("tempfile.mkstemp", refused)
    state.save_material("brass")
    said = state.messages[-1].text
    assert said == f"not saved: {state.folder / 'brass.json'}: cannot be written (Permission denied)"
    assert "brass" not in state.saved
