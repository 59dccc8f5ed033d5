"""Editing in place without a window: transport arrives, edits show, A is compared with B, files are written."""

from __future__ import annotations

import dataclasses
import json
import time

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.light.colour import shown
from lambent.core.light.false_colour import Range, false_colour
from lambent.core.light.photometry import photometric
from lambent.core.pictures.images import to_bytes
from lambent.editing.picture import EditedPicture
from lambent.editing.session.session import Session
from lambent.editing.stored import parts_of
from lambent.materials.document import Material, load_material
from lambent.store.store import Store
from lambent.viewer.edits.tone import _half_bits, _table, displayed
from lambent.viewer.modes.edit import painter
from lambent.viewer.modes.edit.painter import FADE_S
from lambent.viewer.modes.edit.state import DIRECT, OFF, UNEDITED
from tests.viewer.edited_view import LIGHTS, OTHER_TRAY, SHOWN, TRAY, WALL, new_state, pull, settled, tint, until
from tests.viewer.editor.measured_specimens import write_measurement


@pytest.fixture
def quick(monkeypatch):
    """Frames that do not wait for each other."""
    monkeypatch.setattr(painter, "FADE_S", 0.01)
    monkeypatch.setattr(painter, "FRAME_S", 0.001)


@pytest.fixture
def opened(screen, tmp_path):
    state, bakes = new_state(screen, tmp_path)
    yield state, bakes
    state.close()


@pytest.fixture
def ready(quick, opened):
    """With all transport."""
    state, bakes = opened
    until(state, lambda: bakes.begun)
    for lights in LIGHTS:
        bakes.begun[0].arrive(lights)
        until(state, lambda lights=lights: state.loading.lights == lights)
    until(state, lambda: state.baking is None)
    state.screen.clock.now_s += 10
    settled(state)
    return state, bakes


def test_exposure_is_metered_unless_it_was_chosen_before_the_light_came(quick, screen, tmp_path):
    found = []
    for name, chosen in (("metered", 0.0), ("chosen", -1.0)):
        (tmp_path / name).mkdir()
        state, bakes = new_state(screen, tmp_path / name)
        state.look.exposure_ev = chosen
        until(state, lambda bakes=bakes: bakes.begun)
        bakes.begun[0].arrive(LIGHTS[1])
        until(state, lambda state=state: state.loading.lights == LIGHTS[1])
        for _ in range(3):
            settled(state)
        found.append(state.look.exposure_ev)
        state.close()
    assert found[1] == -1.0 and found[0] not in (0.0, -1.0)


def exact(state, session=None, lights=LIGHTS[-1]):
    """The picture (48, 3) of a session, drawn at once from what the store has."""
    session = session or state.session
    originals = {name: session.original(name) for name in session.document.materials}
    picture = EditedPicture(
        state.loading.view.backdrop, parts_of(Store.open(state.loading.folder), session, originals, lights)
    )
    for name in originals:
        picture.show(name, session.editable(name))
    picture.draw()
    return picture.image().reshape(-1, 3)


@pytest.mark.long
def test_the_first_lights_can_be_edited_and_more_come_without_a_jump(opened):
    state, bakes = opened
    until(state, lambda: bakes.begun)
    bake = bakes.begun[0]
    assert state.loading.lights == 0 and bake.store == state.subject.store
    bake.arrive(LIGHTS[0])
    until(state, lambda: state.loading.lights == LIGHTS[0])
    settled(state)
    pull(state.session, "tray")
    state.painter._clock = clock = type(state.screen.clock)()
    clock.now_s = time.monotonic() + 100
    before = settled(state).radiance
    assert np.allclose(before.reshape(-1, 3), exact(state, lights=LIGHTS[0]), atol=1e-4)
    bake.arrive(LIGHTS[1])
    until(state, lambda: state.loading.lights == LIGHTS[1] and not state.painter._tasks)
    number = state.painter.frame.number
    until(state, lambda: state.painter.frame.number > number + 3)
    assert np.allclose(state.painter.frame.radiance, before, atol=1e-4), "time stands still: no jump"
    wanted = exact(state)
    assert np.abs(wanted - before.reshape(-1, 3)).max() > 0.05
    clock.now_s += FADE_S / 2
    number = state.painter.frame.number
    until(state, lambda: state.painter.frame.number > number + 3)
    assert np.allclose(state.painter.frame.radiance.reshape(-1, 3), (wanted + before.reshape(-1, 3)) / 2, atol=1e-3)
    tint(state.session, "wall", 1.9)
    clock.now_s += FADE_S
    assert np.allclose(settled(state).radiance.reshape(-1, 3), exact(state), atol=1e-4)


def test_undo_redo_and_every_edit_show(ready):
    state, bakes = ready
    start = settled(state).radiance
    pull(state.session, "tray", "fresnel")
    edited = settled(state)
    assert np.allclose(edited.radiance.reshape(-1, 3), exact(state), atol=1e-4) and not edited.needed
    assert not np.allclose(edited.radiance, start)
    state.session.undo()
    assert np.allclose(settled(state).radiance, start, rtol=2e-3), "another curve is folded in, in half floats"
    state.session.redo()
    assert np.allclose(settled(state).radiance, edited.radiance, rtol=2e-3)
    assert len(bakes.begun) == 1


def test_another_quotient_is_baked_and_undo_needs_no_bake(ready):
    state, bakes = ready
    before = settled(state).radiance
    assert not state.session.change("tray", OTHER_TRAY)
    until(state, lambda: len(bakes.begun) == 2)
    assert any("new transport" in message.text for message in state.screen.messages)
    assert settled(state).needed == {"tray"}
    assert np.allclose(state.painter.frame.radiance, before, atol=1e-4), "shown as before meanwhile"
    pull(state.session, "wall", "diffuse", 1.2)
    meanwhile = settled(state).radiance.reshape(-1, 3)
    assert not np.allclose(meanwhile[SHOWN["wall"]], before.reshape(-1, 3)[SHOWN["wall"]])
    state.session.undo()
    for lights in LIGHTS:
        bakes.begun[1].arrive(lights, seed=5)
        until(state, lambda: not bakes.begun[1].arrived and not state.loading.busy)
    after = settled(state)
    assert not after.needed and not np.allclose(after.radiance, before)
    assert np.allclose(after.radiance.reshape(-1, 3)[SHOWN["tray"]], exact(state)[SHOWN["tray"]], atol=1e-4)
    state.session.undo()
    assert np.allclose(settled(state).radiance, before, atol=1e-4)
    assert len(bakes.begun) == 2, "the transport from before is still there"


def test_a_bake_that_nobody_needs_any_more_ends(ready):
    state, bakes = ready
    state.session.change("tray", OTHER_TRAY)
    until(state, lambda: len(bakes.begun) == 2)
    state.session.undo()
    until(state, lambda: bakes.begun[1].closed)
    assert state.baking is None and not settled(state).needed


def test_an_error_of_the_bake_is_one_line(opened):
    state, bakes = opened
    until(state, lambda: bakes.begun)
    bakes.begun[0].error, bakes.begun[0].running = "scene has no objects", False
    until(state, lambda: state.baking is None)
    assert state.trouble == "not baked: scene has no objects"
    for _ in range(5):
        state.tick()
    assert len(bakes.begun) == 1


def test_a_complete_store_is_not_baked_again(ready, screen, tmp_path):
    state, bakes = new_state(screen, tmp_path)
    try:
        until(state, lambda: state.loading.lights == LIGHTS[-1] and not state.loading.busy)
        settled(state)
        assert not bakes.begun
        assert np.allclose(state.painter.frame.radiance.reshape(-1, 3), exact(state), atol=1e-4)
    finally:
        state.close()


def test_a_is_what_was_opened_or_a_snapshot(ready):
    state, _ = ready
    start = settled(state).radiance
    assert state.painter.frame.compared is None
    pull(state.session, "tray")
    state.compared.chosen = UNEDITED
    frame = settled(state)
    assert np.allclose(frame.compared_radiance, start, atol=1e-4)
    assert np.allclose(frame.radiance.reshape(-1, 3), exact(state), atol=1e-4)
    state.compared.keep(state.now)
    tint(state.session, "tray", (3.0, 1.0, 1.0))
    again = settled(state)
    assert state.compared.choices == (OFF, DIRECT, UNEDITED, "snapshot 1")
    assert np.allclose(again.compared_radiance, frame.radiance, atol=1e-4)
    assert not np.allclose(again.radiance, frame.radiance)
    state.session.change("tray", OTHER_TRAY)
    state.compared.chosen = OFF
    assert settled(state).compared is None


def test_the_difference_to_a_is_in_false_colours_of_a_fitted_scale(ready):
    state, _ = ready
    state.compared.is_difference = True
    assert state.scale is None and settled(state).compared is None, "there is no A"
    state.compared.chosen = DIRECT
    frame = settled(state)
    assert np.array_equal(frame.compared_radiance, frame.radiance), "nothing else is baked"
    state.compared.chosen, state.compared.scale = UNEDITED, None
    tint(state.session, "tray", (3.0, 0.2, 1.0))
    tint(state.session, "wall", 0.5)
    until(state, lambda: state.compared.scale is not None and settled(state).wish.difference is state.compared.scale)
    frame = state.painter.frame
    above = photometric(frame.radiance - frame.compared_radiance)
    assert above.min() < -1 and above.max() > 1 and frame.compared is None
    assert np.percentile(np.abs(above), 99.5) <= state.scale.high <= 10 * np.abs(above).max()
    assert np.abs(frame.shown.bytes[..., :3] - to_bytes(false_colour(above, state.scale)).astype(int)).max() <= 2


def test_pointing_selecting_and_outlines(ready):
    state, _ = ready
    view = state.loading.view
    assert view.at(3.5 / 8, 0.5 / 6) == ("plate", "tray") and view.at(0.5 / 8, 0.5 / 6) is None
    assert view.at(0.5 / 8, 3.5 / 6) == ("back", "wall") and view.at(1.5, 2.0) is None
    assert state.materials == ("tray", "wall") and view.shares == pytest.approx({"tray": 17 / 38, "wall": 21 / 38})
    assert state.outlined == ()
    state.select_next()
    assert state.material == "wall" and state.outlined == ("back",)
    state.screen.clock.now_s += 2
    assert state.outlined == ()
    state.pointed = ("plate", "tray")
    assert state.outlined == ("plate",)
    edge = view.outline({"plate"})
    assert edge[0, 3, 3] > 0 and not edge[..., 3].reshape(-1)[SHOWN["wall"]].any()
    state.select_next()
    assert state.material == "tray"


def test_sessions_are_saved_under_names_of_their_own(ready):
    state, _ = ready
    folder = state.screen.folder
    (folder / "small room-001.edits.json").write_text("mine")
    assert not state.files.unsaved
    pull(state.session, "tray")
    assert state.files.unsaved
    state.files.save()
    assert (folder / "small room-001.edits.json").read_text() == "mine"
    saved = folder / "small room-002.edits.json"
    assert Session.open(saved).document.materials == state.session.document.materials and not state.files.unsaved
    tint(state.session, "wall", 2.0)
    rescued = list(state.files.rescue())
    assert [file.name for file in rescued] == ["small room-rescued-001.edits.json"]
    wall = json.loads(rescued[0].read_text())["materials"]["wall"]
    assert wall["now"]["kd"][0] == 2 * wall["start"]["kd"][0]
    state.files.save()
    assert Session.open(saved).document.materials == state.session.document.materials
    assert not list(state.files.rescue())


def test_unsaved_materials_are_named_at_the_end(ready, capsys):
    state, _ = ready
    state.files.name_unsaved()
    assert capsys.readouterr().err == ""
    tint(state.session, "wall", 2.0)
    state.files.name_unsaved()
    assert capsys.readouterr().err == "lambent: note: changes not saved: wall\n"


def test_a_material_is_saved_as_a_document(ready):
    state, _ = ready
    tint(state.session, "tray", 2.0)
    state.files.export("tray")
    written = load_material(state.screen.folder / "tray-001.json")
    assert np.allclose(written.kd, np.multiply(TRAY.kd, 2.0)) and written.lobes == TRAY.lobes
    assert written.provenance.notes == ("edited by hand",)


def test_documents_and_tables_are_dropped(ready, tmp_path):
    state, bakes = ready
    OTHER_TRAY.save(tmp_path / "other.json")
    state.material = "wall"
    state.files.open(str(tmp_path / "other.json"), "wall")
    assert [term.name for term in state.session.original("wall").terms] == ["diffuse", "specular"]
    until(state, lambda: len(bakes.begun) == 2)
    state.files.open(str(tmp_path / "missing.json"), "wall")
    (tmp_path / "broken.json").write_text('{"format": 3}')
    state.files.open(str(tmp_path / "broken.json"), "wall")
    assert sum("not loaded" in message.text for message in state.screen.messages) == 2
    assert len(bakes.begun) == 2


@pytest.mark.long
def test_a_measured_table_is_fitted_and_its_fit_is_a_step(ready, tmp_path):
    state, _ = ready
    table = write_measurement(tmp_path / "paper.astm", Material(kd=(0.6, 0.5, 0.4)))
    state.files.open(str(table), "wall")
    with pytest.raises(UserError, match="still fitting"):
        state.files.fitting.begin(table, "auto", print)
    until(state, lambda: not state.files.fitting.busy)
    assert np.allclose(state.session.material("wall").now.kd, (0.6, 0.5, 0.4), atol=0.02)
    assert state.session.material("wall").now.provenance.source == "paper.astm"
    state.session.undo()
    assert state.session.material("wall").now == WALL


def test_an_environment_has_a_store_of_its_own_and_undo_goes_back(ready, tmp_path):
    state, bakes = ready
    before = settled(state).radiance
    (tmp_path / "sky.hdr").write_bytes(b"an image for the bake alone")
    state.files.open(str(tmp_path / "sky.hdr"), "tray")
    until(state, lambda: len(bakes.begun) == 2)
    folder = bakes.begun[1].store
    assert folder != state.subject.store and folder.name.startswith("small room-sky-")
    assert np.allclose(settled(state).radiance, before, atol=1e-4), "until its light is there"
    for lights in LIGHTS:
        bakes.begun[1].arrive(lights, seed=9)
        until(state, lambda: not bakes.begun[1].arrived and not state.loading.busy)
    assert np.allclose(settled(state).radiance.reshape(-1, 3), exact(state), atol=1e-4)
    assert not np.allclose(state.painter.frame.radiance, before)
    state.session.undo()
    until(state, lambda: state.loading.folder == state.subject.store and state.loading.lights == LIGHTS[-1])
    assert np.allclose(settled(state).radiance, before, atol=1e-4) and len(bakes.begun) == 2


@pytest.mark.parametrize("view", ("filmic", "neutral", "linear"))
def test_bytes_are_those_of_the_view_transform(view):
    rng = np.random.default_rng(1)
    light = (10 ** rng.uniform(-5, 5, (40, 50, 3))).astype(np.float32)
    light[0, 0], light[0, 1] = (-0.0, 0.0, 1e9), (np.nan, np.inf, -1.0)
    made = displayed(light, view, -1.2, Range())
    assert made.shape == (40, 50, 4) and (made[..., 3] == 255).all()
    wanted = to_bytes(shown(light[1:], view, -1.2)).astype(int)
    assert np.abs(made[1:, :, :3] - wanted).max() <= 1


def test_the_bytes_of_a_drag_are_those_of_the_table():
    """Every rounding, infinity and what is no number included."""
    rng = np.random.default_rng(2)
    light = rng.integers(0, 2**32, (64, 64, 3), dtype=np.uint32).view(np.float32)
    with np.errstate(invalid="ignore"):
        made, wanted = displayed(light, "filmic", 0.5, Range()), _table("filmic", 0.5)[_half_bits(light)]
    assert np.isnan(light).any() and np.array_equal(made[..., :3], wanted) and (made[..., 3] == 255).all()


def test_frames_that_nobody_takes_are_not_painted(ready, monkeypatch):
    """While it changes, the picture is painted once for each frame of the window."""
    state, _ = ready
    settled(state)
    monkeypatch.setattr(painter, "FRAME_S", 60.0)
    monkeypatch.setattr(painter, "FADE_S", 1e9)
    state.painter.run(lambda: state.painter._fade_over(0 * state.painter.frame.radiance))
    first = state.painter.frame.number
    until(state, lambda: state.painter.frame.number > first)
    for k in range(1, 5):
        time.sleep(0.02)
        assert state.painter.frame.number == first + k
        assert state.painter.take() is state.painter.take()
        until(state, lambda k=k: state.painter.frame.number > first + k)


def test_an_error_in_the_thread_reaches_the_window(ready):
    state, _ = ready

    def fail():
        raise ZeroDivisionError("in the thread")

    state.painter.run(fail)
    with pytest.raises(ZeroDivisionError, match="in the thread"):
        until(state, lambda: False)
    assert dataclasses.is_dataclass(state.painter.frame)


def test_a_merged_material_is_drawn_and_edited_as_the_other(ready):
    state, bakes = ready
    state.select("tray")
    before = settled(state).radiance.reshape(-1, 3)
    state.session.merge("tray", "wall")
    until(state, lambda: len(bakes.begun) == 2)
    assert state.material == "wall" and bakes.begun[1].session.document.merged == {"tray": "wall"}
    assert np.allclose(settled(state).radiance.reshape(-1, 3), before, atol=1e-4), "as before, until it is baked"
    for lights in LIGHTS:
        bakes.begun[1].arrive(lights, seed=3)
        until(state, lambda: not bakes.begun[1].arrived and not state.loading.busy)
    assert state.loading.view.objects == (("plate", "wall"), ("back", "wall")) and state.materials == ("wall",)
    merged = settled(state).radiance.reshape(-1, 3)
    assert np.allclose(merged, exact(state), atol=1e-4)
    tint(state.session, "wall", 2.0)
    twice = settled(state).radiance.reshape(-1, 3)
    backdrop = state.loading.view.backdrop.reshape(-1, 3)
    for pixels in SHOWN.values():
        assert np.allclose((twice - backdrop)[pixels], 2 * (merged - backdrop)[pixels], rtol=1e-3, atol=1e-4)
    state.session.undo()
    state.session.undo()
    until(state, lambda: len(bakes.begun) == 3)
    assert set(bakes.begun[2].session.document.materials) == {"tray", "wall"}, "parted again"
