"""Relighting without a window: the picture is that of `RelitView`, the sky a step of the one history, and it stays."""

import json

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.light.light_mix import GroupMix, LightMix
from lambent.editing.relit_view import RelitView
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import ImageEnvironment
from lambent.store.kept.session import FILE, RelitSky, read_session
from lambent.store.store import MANIFEST, Store
from lambent.viewer.edits.session_file import READ_ONLY
from lambent.viewer.edits.tone import displayed
from lambent.viewer.mode import Drawing
from lambent.viewer.modes.relight.mode import RelightMode
from lambent.viewer.modes.relight.state import NO_SKY
from tests.viewer.modes.relight.conftest import SIZE, settled

COPY = "tray.relight.store"
VIEW = {"camera": load_scene("builtin:teatray").cameras[0], "width": SIZE[0], "height": SIZE[1]}


def expected(store, sky=None, turn_deg=0.0):
    view = RelitView(Store.open(store), **VIEW)
    view.light(None if sky is None else ImageEnvironment(sky))
    view.turn(turn_deg)
    view.draw()
    return view.image()


def keys(store):
    return {artefact.name: artefact.key for artefact in Store.open(store).artefacts()}


@pytest.mark.long
def test_the_picture_is_that_of_the_view(opened, tray, sky, bakes):
    state = opened(tray)
    assert state.size == SIZE and np.array_equal(settled(state), expected(tray))
    state.turn(50.0)
    turned = settled(state)
    assert np.array_equal(turned, expected(tray, turn_deg=50.0))
    state.open(str(sky))
    assert np.array_equal(settled(state), expected(tray, sky, 50.0))
    state.look.exposure_ev, state.look.view_transform = -1.0, "neutral"
    brighter = settled(state)
    assert np.array_equal(brighter, expected(tray, sky, 50.0))
    assert np.array_equal(state.frame.shown.bytes, displayed(brighter, "neutral", -1.0, state.look.scale))
    state.light(None)
    assert np.array_equal(settled(state), turned) and not bakes.begun and not state.said


def test_every_turn_is_within_half_a_turn(opened, tray):
    state = opened(tray, turn_deg=270.0)
    assert state.edits.sky.turn_deg == -90.0
    state.turn(180.0)
    assert state.edits.sky.turn_deg == -180.0


@pytest.mark.long
def test_a_drag_and_an_image_are_one_step_each(opened, tray, sky):
    state = opened(tray)
    before = settled(state)
    for degree in (10.0, 20.0, 30.0):
        state.turn(degree)
        settled(state)
    state.open(str(sky))
    state.open(str(sky))
    assert state.edits.sky.environment.file == "../sky.exr"
    state.edits.undo()
    assert state.edits.sky == RelitSky(turn_deg=30.0)
    state.edits.undo()
    assert np.array_equal(settled(state), before) and not state.edits.can_undo
    state.edits.redo()
    assert np.array_equal(settled(state), expected(tray, turn_deg=30.0))


@pytest.mark.long
def test_the_sky_is_there_again(opened, tray, sky):
    state = opened(tray, environment={"path": sky, "scale": 2.0, "up": "+x"}, turn_deg=20.0)
    picture, wanted = settled(state), state.edits.sky
    assert state.edits.can_undo
    state.close()
    moved = tray.parent / "elsewhere"
    moved.mkdir()
    for one in (tray, sky):
        one.rename(moved / one.name)
    again = opened(moved / tray.name)
    assert again.edits.sky == wanted and not again.edits.can_undo and again.view == state.view
    assert np.array_equal(settled(again), picture)


def test_a_store_that_is_only_looked_at_stays_as_it_is(opened, tray):
    before = (tray / MANIFEST).read_bytes()
    state = opened(tray)
    settled(state)
    state.turn(10.0)
    state.edits.undo()
    state.close()
    assert not (tray / FILE).exists() and (tray / MANIFEST).read_bytes() == before


@pytest.mark.parametrize(
    "said", [{"turn_deg": 400.0}, {"turn_deg": float("nan")}, {"environment": {"file": ""}}, {"tilt_deg": 1.0}]
)
def test_a_sky_that_no_window_writes_is_refused(opened, gold_tray, said):
    session = json.loads((gold_tray / FILE).read_text())
    assert "sky" not in session, "files without one stay as they are"
    (gold_tray / FILE).write_text(json.dumps({**session, "sky": said}))
    with pytest.raises(UserError, match="sky"):
        read_session(gold_tray / FILE)


@pytest.mark.long
def test_edited_materials_are_baked_beside_the_store(opened, gold_tray, bakes):
    before, plain = keys(gold_tray), expected(gold_tray)
    state = opened(gold_tray)
    picture = settled(state)
    copy = gold_tray.parent / COPY
    assert np.array_equal(picture, expected(copy)) and np.abs(picture - plain).max() > 0.01
    assert keys(gold_tray) == before and len(bakes.begun) == 1
    state.turn(40.0)
    settled(state)
    state.close()
    again = opened(gold_tray)
    assert np.array_equal(settled(again), expected(copy, turn_deg=40.0)) and len(bakes.begun) == 1
    again.edits.reset("nickel")
    assert np.array_equal(settled(again), expected(gold_tray, turn_deg=40.0)) and len(bakes.begun) == 1
    again.edits.undo()
    assert np.array_equal(settled(again), expected(copy, turn_deg=40.0))
    again.edits.change("nickel", again.edits.current("nickel").model_copy(update={"kd": (0.1, 0.1, 0.8)}))
    settled(again)
    assert len(bakes.begun) == 2, "and again after another edit"


@pytest.mark.long
def test_an_edit_meanwhile_stops_the_bake(opened, gold_tray, bakes):
    bakes.waits = True
    state = opened(gold_tray)
    state.edits.change("nickel", state.edits.current("nickel"))
    while not bakes.begun:
        state.tick()
    assert state.said[-1] == "baking by hand" and state.frame is None
    state.edits.reset("nickel")
    assert np.array_equal(settled(state), expected(gold_tray)) and bakes.begun[0].closed


def test_leaving_stops_the_bake(opened, gold_tray, bakes):
    bakes.waits = True
    state = opened(gold_tray)
    while not bakes.begun:
        state.tick()
    state.close()
    assert bakes.begun[0].closed and state.baking is None


def test_a_failed_bake_is_a_line(opened, gold_tray, bakes):
    bakes.error = "the disk is full"
    state = opened(gold_tray)
    assert settled(state) is None and state.trouble == "not baked: the disk is full" == state.said[0]


def test_the_folder_of_something_else_is_left_alone(opened, gold_tray):
    Store.create(gold_tray.parent / COPY, {}).close()
    from lambent.baking.running.relit import Relit

    state = opened(gold_tray)
    with pytest.raises(UserError, match=f"{COPY}: is another store"):
        Relit(gold_tray, state.edits.room, state.view).bake()


@pytest.mark.long
def test_a_damaged_store_of_edited_views_is_a_line(opened, gold_tray, bakes):
    copy = gold_tray.parent / COPY
    copy.mkdir()
    (copy / MANIFEST).write_text("{")
    state = opened(gold_tray)
    assert settled(state) is None and state.trouble.startswith("not baked: ") and COPY in state.trouble
    state.edits.reset("nickel")
    assert np.array_equal(settled(state), expected(gold_tray)) and not state.trouble and not bakes.begun


def test_an_image_that_cannot_be_read_is_a_line(opened, tray, sky):
    state = opened(tray)
    before = settled(state)
    sky.write_bytes(sky.read_bytes()[:60])
    state.open(str(sky))
    assert np.array_equal(settled(state), before)
    assert state.said[0].startswith("shown under its own sky") and "sky.exr" in state.said[0]
    state.edits.undo()
    assert np.array_equal(settled(state), before) and not state.said


@pytest.mark.parametrize(
    ("name", "what"), [("absent.hdr", "does not exist"), ("notes.txt", "is no sky"), (" ", "no file")]
)
def test_what_is_no_sky_changes_nothing(opened, tray, tmp_path, name, what):
    (tmp_path / "notes.txt").write_text("sky")
    state = opened(tray)
    state.open(str(tmp_path / name) if name.strip() else name)
    assert what in state.screen.messages[-1].text and state.edits.sky == RelitSky() and not state.edits.can_undo


def test_a_store_that_does_not_know_its_scene_shows_what_it_has(opened, gold_tray):
    with Store.create(gold_tray, {}) as store:
        store.set_document("source", None)
    state = opened(gold_tray)
    assert np.array_equal(settled(state), expected(gold_tray))
    assert "materials and light as baked" in state.said[0] and "scene" in state.said[0]


def test_a_store_that_does_not_know_its_scene_and_has_no_view_says_so(opened, tray, bakes):
    with Store.create(tray, {}) as store:
        store.set_document("source", None)
        store.forget_all()
    state = opened(tray)
    assert settled(state) is None and "no path of its scene" in state.trouble and not bakes.begun


@pytest.mark.long
def test_a_room_without_a_sky_says_so_until_it_has_an_image(opened, baked_box, sky, bakes):
    (baked_box / FILE).unlink(missing_ok=True)
    bakes.waits = True
    state = opened(baked_box, fitting=(40, 30))
    while not bakes.begun:
        state.tick()
    assert state.size == (591, 443) and not state.has_sky and NO_SKY in state.said
    state.open(str(sky))
    assert state.has_sky and NO_SKY not in state.said
    state.edits.undo()


def test_a_second_window_is_read_only(opened, tray):
    opened(tray)
    second = opened(tray)
    settled(second)
    second.turn(10.0)
    second.tick()
    assert second.said[0] == READ_ONLY and second.keeper.unsaved == ("the sky of relit views",)
    second.close()
    assert not (tray / FILE).exists()


def test_a_lost_window_rescues_what_it_owns(opened, tray, capsys):
    first, second = opened(tray), opened(tray)
    for state in (second, first):
        state.turn(10.0)
        RelightMode(state, Drawing(None)).rescue()
        assert (tray / FILE).exists() == (state is first), "the other window's session is not touched"
    assert read_session(tray / FILE).sky.turn_deg == 10.0 and "tray.store" in capsys.readouterr().err


def test_a_light_mix_is_named_as_not_shown(opened, tray):
    state = opened(tray)
    picture = settled(state)
    state.edits.mix(LightMix({"lamp": GroupMix(intensity=0.5)}))
    assert "light mix" in state.said[0] and settled(state) is picture


def test_wrong_names_are_refused(opened, tray):
    with pytest.raises(UserError, match="--camera"):
        opened(tray, camera="nowhere")
    with pytest.raises(UserError, match=r"absent\.hdr"):
        opened(tray, environment={"path": tray / "absent.hdr"})
    assert opened(tray, camera="front").keeper.has_lock, "what failed has released the session"
