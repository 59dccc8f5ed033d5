"""Edits of a store's view are in the store's session: kept at once, beside the room, from the materials of the room."""

import json

import pytest

from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.editing.curves.operators import Region
from lambent.editing.session.document import OfDocument
from lambent.editing.session.session import Session
from lambent.materials.document import Material
from lambent.store.kept.session import FILE, FORMER_BACKUP, KeptLook, KeptView, RoomState, WalkSession, read_session
from lambent.store.kept.session import write_session as write
from lambent.store.store import Store
from lambent.viewer.edits.session_file import READ_ONLY
from lambent.viewer.look import Look
from lambent.viewer.modes.edit.files import Files
from lambent.viewer.modes.edit.in_place import InPlace
from lambent.viewer.modes.edit.subject import opened
from lambent.viewer.screen import Rect, Screen
from tests.viewer.conftest import Clock

LOW = Region(a=-0.2, b=0.0, c=0.3, d=0.9)
RED = Material(name="glaze", kd=(0.6, 0.1, 0.1))
GOLD = Material(name="gold", kd=(0.5, 0.4, 0.1))
VIEW = KeptView(camera=Camera("free", (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)), look=KeptLook(exposure_ev=-2.0, base_ev=-1.0))


@pytest.fixture
def store(tmp_path):
    with Store.create(tmp_path / "tray.store", {}) as made:
        made.set_document("source", "builtin:teatray")
    return tmp_path / "tray.store"


class Window:
    """A view of the store, edited in place, without its picture."""

    def __init__(self, store, **how):
        self.screen, self.look = Screen(store.parent, Clock(), Rect(0, 0, 40, 30)), Look()
        self.keeper = InPlace(store, self.screen, 3600.0)
        self.subject = opened(store, store.parent, keeper=self.keeper, **how)
        self.session = self.subject.session
        self.files = Files(self.session, self.screen, self.subject.name, None, self.keeper)
        self.keeper.begin(self.session, self.look)

    def pull(self, y=2.0):
        self.session.pull("nickel", "highlight", LOW, y=y)

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


def curves(window):
    return {name: one.curves for name, one in window.session.document.materials.items() if one.curves}


def test_edits_are_there_again_and_the_room_stays(edited, store):
    before = read_session(store / FILE)
    edited.rest()
    kept = read_session(store / FILE)
    assert (kept.now, kept.view) == (before.now, before.view) and set(kept.edited) == {"front"}
    assert not edited.files.unsaved and list(store.parent.glob("*.edits.json")) == []
    edited.close()
    again = Window(store)
    assert again.session.document == edited.session.document and again.session.document.size == (20, 10)
    assert not again.session.history.can_undo and not again.files.unsaved
    again.session.pull("glaze", "diffuse", LOW, y=0.1)
    again.close()
    assert set(curves(Window(store).close())) == {"nickel", "glaze"}


def test_a_view_that_is_not_edited_is_not_written(store):
    Window(store).close()
    assert not (store / FILE).exists()


def test_views_have_edits_of_their_own(edited, store):
    edited.close()
    (store / "views.json").write_text(
        json.dumps({"format": "lambent-views", "version": 1, "cameras": [{"name": "side", **PLACE}]})
    )
    side = Window(store, camera="side")
    assert curves(side) == {}
    side.pull(3.0)
    side.close()
    assert set(read_session(store / FILE).edited) == {"front", "side"}
    assert curves(Window(store).close()) != curves(Window(store, camera="side").close())


def test_a_view_that_was_renamed_keeps_its_edits(edited, store):
    edited.close()
    said = json.loads((store / FILE).read_text())
    said["edited"] = {"before": said["edited"]["front"]}
    said["edited"]["before"]["document"]["camera"]["name"] = "before"
    (store / FILE).write_text(json.dumps(said))
    again = Window(store)
    assert curves(again) == curves(edited)
    again.pull(1.0)
    again.close()
    assert set(read_session(store / FILE).edited) >= {"front"}


PLACE = {"position": [1.0, 1.0, 1.0], "target": [0.0, 0.0, 0.0]}


def test_a_view_starts_from_the_rooms_materials(edited):
    assert edited.session.document.materials["glaze"].source == OfDocument(material=RED)


def change_room(store, **materials):
    kept = read_session(store / FILE)
    now = kept.now.model_copy(update={"materials": {**kept.now.materials, **materials}})
    write(store / FILE, kept.model_copy(update={"now": now}))


def test_a_material_that_was_edited_in_the_room_since_then_starts_from_there(edited, store):
    edited.session.pull("glaze", "diffuse", LOW, y=0.1)
    edited.close()
    blue = RED.model_copy(update={"kd": (0.1, 0.1, 0.6)})
    change_room(store, glaze=blue)
    again = Window(store)
    assert again.session.document.materials["glaze"].source == OfDocument(material=blue)
    assert curves(again) == curves(edited), "its curves are edited as before"
    again.close()


def test_the_room_shows_a_material_as_edited_and_the_way_back_is_exact(edited, store):
    edited.files.export("nickel", into_room=True)
    while edited.files.busy:
        edited.files.poll()
    edited.close()
    shown = read_session(store / FILE).now.materials["nickel"]
    assert shown == edited.files.exported.material and "the room shows nickel" in edited.screen.messages[0].text
    again = Window(store)
    assert again.session.document == edited.session.document, "the fit is not edited again"
    again.close()
    change_room(store, nickel=GOLD)
    after = Window(store)
    assert after.session.document.materials["nickel"].source == OfDocument(material=GOLD) and curves(after) == {}
    after.close()


def test_exposure_and_view_transform_are_the_sessions(edited, store):
    assert edited.keeper.has_exposure and edited.look.exposure_ev == -2.0
    edited.look.step(1)
    edited.look.view_transform = "linear"
    edited.close()
    look = read_session(store / FILE).view.look
    assert look.exposure_ev == pytest.approx(-2 + 1 / 3) and (look.base_ev, look.view_transform) == (-1.0, "linear")


def former_edits(store, number, y):
    session = opened(store, store.parent).session
    session.pull("nickel", "highlight", LOW, y=y)
    file = store.parent / f"teatray-{number:03}.edits.json"
    session.save(file)
    return file, session.document


def test_edits_of_a_file_of_their_own_are_taken_once(store):
    former_edits(store, 1, 2.0)
    file, document = former_edits(store, 2, 3.0)
    (store.parent / "teatray-003.edits.json").write_text("{")
    other = Session(document.model_copy(update={"scene": "builtin:teatray"}))
    other.save(store.parent / "teatray-004.edits.json")
    window = Window(store)
    assert window.session.document.materials == document.materials
    assert any("teatray-003" in line for line in window.keeper.lines)
    assert "the edits of teatray-002.edits.json are in the store's session from now on" in window.keeper.lines
    window.close()
    file.unlink()
    again = Window(store)
    assert again.session.document.materials == document.materials and again.keeper.lines == []
    again.close()


def test_a_second_window_is_read_only_and_can_save_a_file(edited, store):
    other = Window(store)
    other.pull(5.0)
    other.rest()
    assert other.keeper.fault == READ_ONLY and other.files.unsaved and other.keeper.lines == []
    other.files.save()
    assert not other.files.unsaved and (store.parent / "teatray-001.edits.json").is_file()
    other.close()
    assert read_session(store / FILE).edited == {}
    edited.close()


def test_a_lost_window_leaves_its_edits_in_the_store(edited, store):
    (said,) = edited.files.rescue()
    assert str(store) in said and set(read_session(store / FILE).edited) == {"front"}
    edited.close()


def test_a_backup_of_the_walk_stays_for_the_walk(edited, store):
    write(store / FORMER_BACKUP, WalkSession())
    edited.close()
    assert (store / FORMER_BACKUP).exists()


def test_materials_that_the_scene_lacks_stay_in_the_file(edited, store):
    edited.close()
    said = json.loads((store / FILE).read_text())
    materials = said["edited"]["front"]["document"]["materials"]
    materials["gold"] = materials["nickel"]
    (store / FILE).write_text(json.dumps(said))
    again = Window(store)
    assert "gold" not in again.session.document.materials
    again.pull(1.0)
    again.close()
    assert "gold" in read_session(store / FILE).edited["front"].document["materials"]


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


@pytest.mark.parametrize("change", [{"size": [0, 1]}, {"materials": {"nickel": {"source": "a"}}}, {"version": 9}])
def test_edits_that_cannot_be_used_are_one_line(edited, store, change):
    edited.close()
    said = json.loads((store / FILE).read_text())
    said["edited"]["front"]["document"] |= change
    (store / FILE).write_text(json.dumps(said))
    with pytest.raises(UserError) as raised:
        Window(store)
    assert FILE in str(raised.value) and next(iter(change)) in str(raised.value) and "\n" not in str(raised.value)
