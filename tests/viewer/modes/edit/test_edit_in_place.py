"""Edits of a store's view are in the store's session: kept at once, and the room's materials are the view's."""

import json

import pytest

from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.editing.session.session import Session
from lambent.materials.document import Lobe, Material
from lambent.store.kept.session import FILE, FORMER_BACKUP, KeptLook, KeptView, RoomState, WalkSession, read_session
from lambent.store.kept.session import write_session as write
from lambent.store.store import Store
from lambent.viewer.edits.edits import MaterialEdits
from lambent.viewer.edits.keeping import SessionKeeper
from lambent.viewer.edits.rooms_view import RoomsView
from lambent.viewer.edits.session_file import READ_ONLY
from lambent.viewer.look import Look
from lambent.viewer.modes.edit.files import Files
from lambent.viewer.modes.edit.subject import opened
from lambent.viewer.screen import Rect, Screen
from tests.viewer.conftest import Clock
from tests.viewer.edited_view import pull

RED = Material(name="glaze", kd=(0.6, 0.1, 0.1))
GOLD = Material(name="gold", kd=(0.5, 0.4, 0.1))
VIEW = KeptView(camera=Camera("free", (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)), look=KeptLook(exposure_ev=-2.0, base_ev=-1.0))
PLACE = {"position": [1.0, 1.0, 1.0], "target": [0.0, 0.0, 0.0]}


@pytest.fixture
def store(tmp_path):
    with Store.create(tmp_path / "tray.store", {}) as made:
        made.set_document("source", "builtin:teatray")
    return tmp_path / "tray.store"


class Window:
    """A view of the store, edited in place, without its picture."""

    def __init__(self, store, **how):
        self.screen, self.look = Screen(store.parent, Clock(), Rect(0, 0, 40, 30)), Look()
        self.subject = opened(store, self.screen, soon_s=3600.0, **how)
        self.session, self.edits, self.keeper = self.subject.session, self.subject.edits, self.subject.keeper
        self.files, self.room = Files(self.subject, self.screen), RoomsView(self.keeper, self.look)

    def pull(self, by=2.0):
        pull(self.session, "nickel", by=by)

    def rest(self):
        self.files.poll()
        self.keeper._finish()

    def close(self):
        self.files.close()
        return self


@pytest.fixture
def edited(store):
    """After one edit of a store in whose room the glaze is red."""
    write(store / FILE, WalkSession(now=RoomState(materials={"glaze": RED}), view=VIEW))
    window = Window(store, picture=(20, 10))
    window.pull()
    return window


def materials(window):
    return {name: one.now for name, one in window.session.document.materials.items()}


def changed(window):
    """The materials that are not as baked."""
    return {name for name, one in window.session.document.materials.items() if one.now != window.edits.scene[name]}


def test_edits_are_the_rooms_and_there_again(edited, store):
    before = read_session(store / FILE)
    edited.rest()
    kept = read_session(store / FILE)
    assert kept.now.materials == {"glaze": RED, "nickel": materials(edited)["nickel"]}
    assert kept.view == before.view and set(kept.edited) == {"front"}
    assert not edited.files.unsaved and list(store.parent.glob("*.edits.json")) == []
    edited.close()
    again = Window(store)
    assert again.session.document == edited.session.document and again.session.document.size == (20, 10)
    assert not again.session.history.can_undo and not again.files.unsaved
    pull(again.session, "glaze", "diffuse", 1.2)
    again.close()
    last = Window(store).close()
    assert changed(last) == {"nickel", "glaze"} and materials(last) == materials(again)


def test_a_view_that_is_not_edited_is_not_written(store):
    Window(store).close()
    assert not (store / FILE).exists()


@pytest.mark.long
def test_views_share_the_rooms_materials(edited, store):
    edited.close()
    (store / "views.json").write_text(
        json.dumps({"format": "lambent-views", "version": 1, "cameras": [{"name": "side", **PLACE}]})
    )
    side = Window(store, camera="side")
    assert materials(side) == materials(edited)
    side.pull(3.0)
    side.close()
    assert set(read_session(store / FILE).edited) == {"front", "side"}
    front = Window(store).close()
    assert materials(front) == materials(side) != materials(edited)


def test_a_view_that_was_renamed_keeps_its_size(edited, store):
    edited.close()
    said = json.loads((store / FILE).read_text())
    said["edited"] = {"before": said["edited"]["front"]}
    said["edited"]["before"]["document"]["camera"]["name"] = "before"
    (store / FILE).write_text(json.dumps(said))
    again = Window(store)
    assert again.session.document.size == (20, 10) and materials(again) == materials(edited)
    again.pull(1.5)
    again.close()
    assert set(read_session(store / FILE).edited) >= {"front"}


def change_room(store, **others):
    kept = read_session(store / FILE)
    now = kept.now.model_copy(update={"materials": {**kept.now.materials, **others}})
    write(store / FILE, kept.model_copy(update={"now": now}))


def test_a_material_that_was_edited_in_the_room_is_the_views(edited, store):
    assert materials(edited)["glaze"] == RED
    edited.close()
    blue = RED.model_copy(update={"kd": (0.1, 0.1, 0.6)})
    change_room(store, glaze=blue)
    again = Window(store).close()
    assert materials(again) == {**materials(edited), "glaze": blue}


def test_transport_starts_where_an_edit_has_changed_the_quotient(edited, store):
    start = edited.session.material("nickel").start
    assert start == edited.edits.scene["nickel"], "a pulled curve leaves the quotient"
    lobes = tuple(lobe.model_copy(update={"alpha": 0.7}) for lobe in materials(edited)["nickel"].lobes)
    other = materials(edited)["nickel"].model_copy(update={"lobes": lobes})
    assert not edited.session.change("nickel", other)
    edited.pull()
    edited.close()
    again = Window(store).close()
    assert again.session.material("nickel").start == other and materials(again) == materials(edited)


def test_undo_takes_back_an_edit_in_the_room_and_the_view_at_once(edited, store):
    edited.session.undo()
    assert edited.edits.edited == {"glaze": RED} and materials(edited)["nickel"] == edited.edits.scene["nickel"]
    edited.session.redo()
    assert set(edited.edits.edited) == {"glaze", "nickel"}
    edited.close()


def test_exposure_and_view_transform_are_the_sessions(edited, store):
    assert edited.room.has_exposure and edited.look.exposure_ev == -2.0
    edited.look.step(1)
    edited.look.view_transform = "linear"
    edited.close()
    look = read_session(store / FILE).view.look
    assert look.exposure_ev == pytest.approx(-2 + 1 / 3) and (look.base_ev, look.view_transform) == (-1.0, "linear")


def former_edits(store, number, by):
    window = Window(store)
    window.pull(by)
    file = store.parent / f"teatray-{number:03}.edits.json"
    window.session.save(file)
    window.session.undo()
    window.close()
    (store / FILE).unlink(missing_ok=True)
    return file, Session.open(file).document


@pytest.mark.long
def test_edits_of_a_file_of_their_own_are_taken_once(store):
    former_edits(store, 1, 2.0)
    file, document = former_edits(store, 2, 3.0)
    (store.parent / "teatray-003.edits.json").write_text("{")
    other = Session(document.model_copy(update={"scene": "builtin:teatray"}))
    other.save(store.parent / "teatray-004.edits.json")
    window = Window(store)
    assert window.session.document.materials == document.materials
    assert any("teatray-003" in line for line in window.subject.lines)
    assert "the edits of teatray-002.edits.json are in the store's session from now on" in window.subject.lines
    assert window.session.history.can_undo
    window.close()
    file.unlink()
    again = Window(store)
    assert again.session.document.materials == document.materials and again.subject.lines == ()
    again.close()


def of_version_1(store, name, material, **edits):
    """The store's session, whose view has a material edited as version 1 did."""
    one = {"source": {"kind": "document", "material": material.model_dump(mode="json")}, **edits}
    camera = {"name": "front", "position": [0.0, 0.35, 0.8], "target": [0.0, 0.1, 0.0]}
    document = {
        "format": "lambent-edit-session", "version": 1, "scene": ".", "camera": camera, "size": [20, 10],
        "materials": {name: one},
    }  # fmt: skip
    room = {"room": {name: material.model_dump(mode="json")}}
    said = json.loads(WalkSession(now=RoomState(materials={name: material})).model_dump_json())
    said["edited"] = {"front": {"document": document, **room}}
    (store / FILE).write_text(json.dumps(said))
    return said


@pytest.mark.long
def test_edits_of_version_1_become_the_rooms_as_a_step(store):
    of_version_1(store, "glaze", RED, tints={"diffuse": [0.5, 0.5, 0.5]})
    window = Window(store)
    assert materials(window)["glaze"].kd == pytest.approx((0.3, 0.05, 0.05))
    assert window.edits.current("glaze") == materials(window)["glaze"]
    window.session.undo()
    assert materials(window)["glaze"] == RED
    window.session.redo()
    window.close()
    assert read_session(store / FILE).edited["front"].document["version"] == 2
    again = Window(store)
    assert materials(again) == materials(window) and not again.session.history.can_undo
    again.close()


@pytest.mark.parametrize("why", ["shown", "edited since"])
def test_the_room_stays_where_it_is_newer_than_edits_of_version_1(store, why):
    said = of_version_1(store, "glaze", RED, tints={"diffuse": [0.5, 0.5, 0.5]})
    now = Material(name="glaze", kd=0.4)
    said["now"]["materials"]["glaze"] = now.model_dump(mode="json")
    if why == "shown":
        said["edited"]["front"] |= {"shown": ["glaze"], "room": {"glaze": now.model_dump(mode="json")}}
    (store / FILE).write_text(json.dumps(said))
    assert materials(Window(store).close())["glaze"] == now


def test_a_second_window_is_read_only_and_can_save_a_file(edited, store):
    other = Window(store)
    other.pull(5.0)
    other.rest()
    assert other.keeper.fault == READ_ONLY and other.files.unsaved and other.subject.lines == (READ_ONLY,)
    other.files.save()
    assert not other.files.unsaved and (store.parent / "teatray-001.edits.json").is_file()
    other.close()
    assert read_session(store / FILE).edited == {}
    edited.close()


def test_a_lost_window_leaves_its_edits_in_the_store(edited, store):
    (said,) = edited.files.rescue()
    assert str(store) in said and set(read_session(store / FILE).edited) == {"front"}
    edited.close()


def test_a_backup_of_the_walk_is_taken_as_the_walk_does(edited, store):
    edited.close()
    write(store / FORMER_BACKUP, WalkSession(now=RoomState(materials={"nickel": GOLD})))
    again = Window(store)
    assert materials(again)["nickel"] == GOLD and again.session.history.can_undo
    again.close()
    assert not (store / FORMER_BACKUP).exists()


def test_materials_that_the_scene_lacks_stay_in_the_file(edited, store):
    edited.close()
    change_room(store, gold=GOLD)
    again = Window(store)
    assert "gold" not in again.session.document.materials
    again.pull(1.5)
    again.close()
    assert read_session(store / FILE).now.materials["gold"] == GOLD


def test_other_commands_open_an_edited_view_by_its_camera(edited, store):
    edited.close()
    (moved := store.with_name("moved.store")).mkdir()
    (store / FILE).rename(moved / FILE)
    document = edited.session.document
    for name in (FILE, f"{FILE}:front"):
        found = Session.open(moved / name)
        assert found.document.materials == document.materials and found.document.size == document.size
        assert found.path(found.document.scene).resolve() == moved.resolve()
    with pytest.raises(UserError, match=r"unknown view.*back.*front"):
        Session.open(moved / f"{FILE}:back")
    kept = read_session(moved / FILE)
    write(moved / FILE, kept.model_copy(update={"edited": {**kept.edited, "side": kept.edited["front"]}}))
    with pytest.raises(UserError, match=r"which edited view\?; found front, side; expected session.json:CAMERA"):
        Session.open(moved / FILE)
    assert Session.open(moved / f"{FILE}:side").document.materials == document.materials


def test_other_commands_see_what_the_room_has_changed_since(edited, store):
    edited.close()
    room = MaterialEdits(edited.edits.scene)
    keeper = SessionKeeper(room, store, edited.screen)
    keeper.open()
    room.reset("glaze")
    room.change("nickel", GOLD)
    keeper.close()
    assert {name: one.now for name, one in Session.open(store / FILE).document.materials.items()} == {
        **room.scene,
        "nickel": GOLD,
    }


@pytest.mark.parametrize("change", [{"size": [0, 1]}, {"materials": {"nickel": {"start": "a"}}}, {"version": 9}])
def test_edits_that_cannot_be_used_are_one_line(edited, store, change):
    edited.close()
    said = json.loads((store / FILE).read_text())
    said["edited"]["front"]["document"] |= change
    (store / FILE).write_text(json.dumps(said))
    with pytest.raises(UserError) as raised:
        Window(store)
    assert FILE in str(raised.value) and next(iter(change)) in str(raised.value) and "\n" not in str(raised.value)
    assert said == json.loads((store / FILE).read_text()), "nothing is lost"


def test_a_gloss_lobe_is_the_same_lobe_in_the_room(edited, store):
    """What is pulled here is what the walk evaluates: the document, to the bit."""
    edited.close()
    (lobe,) = read_session(store / FILE).now.materials["nickel"].lobes
    assert isinstance(lobe, Lobe) and lobe.distribution == "curve"
    assert materials(Window(store).close())["nickel"].lobes == (lobe,)
