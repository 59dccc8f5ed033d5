"""Sessions: materials of a view as documents, undo, and the file they are saved in."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.editing.curves.nodes import Which
from lambent.editing.session import document
from lambent.editing.session.history import History
from lambent.editing.session.session import Session
from lambent.materials.document import Lobe, Material, Provenance
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import same_quotients
from lambent.scenes.scene import ImageEnvironment
from lambent.store.kept.session import Surroundings
from tests.editing.pulled_materials import with_node
from tests.materials.test_curve_lobes import KD_CURVE, curve_lobe

CAMERA = Camera("view", (0.0, 1.0, 3.0), (0.0, 0.0, 0.0))
TRAY = Material(name="tray", kd=(0.3, 0.2, 0.1), lobes=(Lobe(mx=0.1, my=0.1),))
POT = Material(
    name="pot", kd=0.2, kd_curve=KD_CURVE,
    lobes=(curve_lobe(mx=0.2, my=0.1), Lobe(mx=0.3, my=0.3, side="transmission")),
    provenance=Provenance(source="pot.bsdf", notes=("3 lobes tried",)),
)  # fmt: skip
BRUSHED = Material(name="tray", lobes=(Lobe(mx=0.1, my=0.3, distribution="beckmann"),))
SHAPE, FRESNEL, DIFFUSE = Which("shape"), Which("fresnel"), Which("diffuse")


def session(tray: Material = TRAY) -> Session:
    return Session.new("room", CAMERA, {"tray": tray, "pot": POT})


def with_lobe(material: Material, **numbers: object) -> Material:
    return material.model_copy(update={"lobes": (material.lobes[0].model_copy(update=numbers), *material.lobes[1:])})


def test_without_edits_it_is_the_material() -> None:
    one = session()
    for name, material in (("tray", TRAY), ("pot", POT)):
        made, expected = one.editable(name), of_material(material)
        assert one.material(name).start is one.material(name).now is material
        assert made.terms == expected.terms == one.original(name).terms
        assert all(np.array_equal(made.curves[c].values, curve.values) for c, curve in expected.curves.items())
    assert not one.history.can_undo


GGX = with_lobe(BRUSHED, distribution="ggx")
SERVED = {
    "colour": (TRAY, TRAY.model_copy(update={"kd": (0.5, 0.0, 0.1)})),
    "width": (TRAY, with_lobe(TRAY, mx=0.3, my=0.3)),
    "reflectance": (TRAY, with_lobe(TRAY, r0=(0.5, 0.6, 0.7), k=(0.1, 0.2, 0.3))),
    "distribution": (TRAY, with_lobe(TRAY, distribution="ggx")),
    "node": (TRAY, with_node(TRAY, SHAPE, 4, 2.0)),
    "reflectance at an angle": (TRAY, with_node(TRAY, FRESNEL, 3, 5.0)),
    "diffuse at an angle": (TRAY, with_node(TRAY, DIFFUSE, 1, 0.5)),
    "node of a stretched lobe": (GGX, with_node(GGX, SHAPE, 4, 2.0)),
    "node of the second lobe": (POT, with_node(POT, Which("shape", 1), 4, 2.0)),
}
COUPLED = TRAY.model_copy(update={"kd_coupled": True})
MOVED = {
    "alpha": (TRAY, with_lobe(TRAY, alpha=0.5)),
    "ratio of slopes": (TRAY, with_lobe(TRAY, mx=0.1, my=0.2)),
    "node of a lobe of two slopes": (BRUSHED, with_node(BRUSHED, SHAPE, 4, 2.0)),
    "node of a coupled diffuse term": (COUPLED, with_node(COUPLED, DIFFUSE, 1, 0.5)),
    "a lobe more": (TRAY, TRAY.model_copy(update={"lobes": (*TRAY.lobes, Lobe(mx=0.3, my=0.3))})),
    "a lobe less": (TRAY, TRAY.model_copy(update={"lobes": ()})),
    "side": (TRAY, with_lobe(TRAY, side="transmission")),
}


@pytest.mark.parametrize("case", SERVED)
def test_edits_of_curves_keep_what_transport_is_for(case: str) -> None:
    before, after = SERVED[case]
    one = session(before)
    assert one.change("tray", after)
    assert one.material("tray").start is before and one.material("tray").now is after
    assert same_quotients(one.original("tray"), one.editable("tray"))
    assert one.original("tray").terms == of_material(before).terms
    assert one.editable("tray").terms == of_material(after).terms


@pytest.mark.parametrize("case", MOVED)
def test_edits_of_quotients_move_what_transport_is_for(case: str) -> None:
    before, after = MOVED[case]
    one = session(before)
    assert not one.change("tray", after)
    assert one.material("tray").start is one.material("tray").now is after
    assert one.original("tray").terms == of_material(after).terms
    dim = after.model_copy(update={"kd": (0.01, 0.01, 0.01)}) if any(after.kd) else with_lobe(after, k=(0.1, 0.1, 0.1))
    assert one.change("tray", dim) and one.material("tray").start is after
    assert not one.change("tray", before) and one.material("tray").start is before
    for _ in range(3):
        one.undo()
    assert one.material("tray").start is one.material("tray").now is before


def test_an_edit_is_undone_and_redone_with_its_curves() -> None:
    one = session()
    start, rougher = one.editable("tray"), with_lobe(TRAY, mx=0.3, my=0.3)
    one.change("tray", rougher)
    after = one.editable("tray").curves["highlight"].values
    assert not np.allclose(after, start.curves["highlight"].values)
    one.undo()
    assert one.document == session().document
    assert np.array_equal(one.editable("tray").curves["highlight"].values, start.curves["highlight"].values)
    one.redo()
    assert one.material("tray").now is rougher
    assert np.array_equal(one.editable("tray").curves["highlight"].values, after)


def test_an_edit_that_changes_nothing_is_no_step() -> None:
    one = session()
    assert one.change("tray", TRAY) and one.change("tray", TRAY.model_copy()) and not one.history.can_undo
    one.reset("tray")
    assert not one.history.can_undo


def test_a_material_is_restored_as_its_transport_was_computed() -> None:
    one = session()
    one.change("tray", with_lobe(TRAY, alpha=0.5))
    one.change("tray", with_lobe(TRAY, alpha=0.5, mx=0.2, my=0.2))
    one.reset("tray")
    assert one.material("tray").now == with_lobe(TRAY, alpha=0.5)


def test_a_stroke_over_two_materials_is_one_step() -> None:
    one = session()
    with one.stroke():
        for k in range(1, 5):
            one.history.restart_stroke()
            one.change("tray", with_lobe(TRAY, mx=0.1 * k, my=0.1 * k))
            one.change("pot", POT.model_copy(update={"kd": (0.1 * k,) * 3}))
    assert one.material("tray").now.lobes[0].mx == 0.4 and one.material("pot").now.kd[0] == 0.4
    one.undo()
    assert one.document == session().document and not one.history.can_undo
    with pytest.raises(UserError), one.stroke():
        one.change("tray", with_lobe(TRAY, mx=0.3, my=0.3))
        one.change("no such material", TRAY)
    assert one.document == session().document


def test_sessions_go_on_with_the_steps_of_others() -> None:
    steps = History(session().document)
    one, other = Session(steps), Session(steps)
    one.change("tray", with_node(TRAY, SHAPE, 0, 3.0))
    assert other.document is one.document
    other.undo()
    assert one.material("tray").now == TRAY


def test_curves_are_made_once_and_those_of_other_lobes_stay() -> None:
    one = session()
    before = one.editable("pot")
    assert one.editable("pot") is before
    one.change("pot", with_node(POT, Which("shape", 1), 3, 2.0))
    after = one.editable("pot")
    assert after.curves["lobe 1 highlight"] is before.curves["lobe 1 highlight"]
    assert after.curves["lobe 2 highlight"] is not before.curves["lobe 2 highlight"]


def test_names_that_do_not_exist_are_refused() -> None:
    one = session()
    for edit in (
        lambda: one.change("trya", TRAY),
        lambda: one.reset("trya"),
        lambda: one.editable("trya"),
        lambda: one.original("trya"),
        lambda: one.merge("trya", "pot"),
    ):
        with pytest.raises(UserError, match=r"unknown material.*did you mean 'tray'"):
            edit()
    assert not one.history.can_undo


def test_a_session_is_saved_and_read(tmp_path: Path) -> None:
    one = session()
    one.change("tray", with_node(with_node(TRAY, SHAPE, 3, 1.7), DIFFUSE, 2, 0.31))
    one.change("pot", with_node(POT, FRESNEL, 5, 1 / 3))
    one.save(file := tmp_path / "edits.json")
    again = Session.open(file)
    assert again.document == one.document
    for name in ("tray", "pot"):
        for a, b in ((one.editable(name), again.editable(name)), (one.original(name), again.original(name))):
            assert a.terms == b.terms
            assert all(np.array_equal(a.curves[c].values, b.curves[c].values) for c in a.curves)
    text = file.read_bytes()
    again.save(file)
    assert file.read_bytes() == text


def test_files_are_named_from_the_sessions_folder(tmp_path: Path) -> None:
    (tmp_path / "a" / "store").mkdir(parents=True)
    (tmp_path / "b").mkdir()
    (tmp_path / "sky.hdr").write_bytes(b"")
    around = Surroundings(file=str(tmp_path / "sky.hdr"), rotation_deg=90)
    one = Session.new("store", CAMERA, {}, environment=around)
    one.folder = tmp_path / "a"
    one.save(tmp_path / "b" / "edits.json")
    again = Session.open(tmp_path / "b" / "edits.json")
    assert again.document.scene == "../a/store"
    assert again.path(again.document.environment.file) == tmp_path / "sky.hdr"
    again.save(tmp_path / "edits.json")
    assert Session.open(tmp_path / "edits.json").document.scene == "a/store"


def changed(*path: str, **keys: object) -> dict[str, object]:
    """The parsed document of `session()` with keys at a place; None takes a key away."""
    data = json.loads(session().document.model_dump_json())
    node = data
    for step in path:
        node = node[int(step)] if isinstance(node, list) else node[step]
    node.update(keys)
    for key in [key for key, value in keys.items() if value is None]:
        del node[key]
    return data


NOW = ("materials", "tray", "now")
REFUSED = {
    "unknown key": (changed(lihgts=5), r"unknown key.*did you mean 'lights'"),
    "unknown key of a material": (changed("materials", "tray", nwo=1), r"materials.tray.nwo.*did you mean 'now'"),
    "unknown key of a lobe": (changed(*NOW, "lobes", "0", rouhgness=1), r"materials.tray.now.lobes.0.rouhgness"),
    "later version": (changed(version=3), "unsupported session version; found 3; expected 2; use the Lambent"),
    "no version at all": (changed(version="2"), "unsupported session version"),
    "pixels": (changed(size=[100000, 100000]), "pixels"),
    "environment": (changed(environment={"file": "a.hdr", "scale": -1}), "environment.scale"),
    "camera": (changed("camera", fov_y_deg=0), "camera"),
    "half a material": (
        changed("materials", "tray", now=None),
        r"materials.tray.now: is missing",
    ),
    "shape": (changed("materials", "pot", "now", "lobes", "0", shape=[1.0, 0.5]), r"materials.pot.now.lobes.0"),
    "colour": (changed(*NOW, kd=[-1, 0, 0]), r"materials.tray.now.kd"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_documents_that_cannot_be_used_are_refused_by_field(case: str, tmp_path: Path) -> None:
    change, named = REFUSED[case]
    (tmp_path / "edits.json").write_text(json.dumps(change))
    with pytest.raises(UserError, match=named) as caught:
        Session.open(tmp_path / "edits.json")
    assert "edits.json" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "[]", "{}", "3", "[" * 100_000, "\xff", '{"format": NaN}'])
def test_other_files_are_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "edits.json").write_text(text, encoding="latin-1")
    with pytest.raises(UserError):
        Session.open(tmp_path / "edits.json")


def test_huge_files_are_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session().save(file := tmp_path / "edits.json")
    monkeypatch.setattr(document, "LIMIT_BYTES", file.stat().st_size - 1)
    with pytest.raises(UserError, match="too large"):
        Session.open(file)


def test_a_failed_save_leaves_the_file(tmp_path: Path) -> None:
    session().save(file := tmp_path / "edits.json")
    before = file.read_bytes()
    with pytest.raises(UserError):
        session().save(tmp_path)
    assert file.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["edits.json"]


def places(node: object, at: tuple[object, ...] = ()) -> list[tuple[object, ...]]:
    """Every key of a parsed document, from the top."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    return [path for key, value in items for path in ((*at, key), *places(value, (*at, key)))]


WRONG = (None, -1, 0, 1e308, 10**400, "", "x" * 5000, [], {}, [1, 2, 3], True, "highlight", "..\x00")


def damaged(good: str) -> list[str]:
    """The parsed document with any value in place of any other, as text."""
    found = []
    for number, path in enumerate(places(json.loads(good))):
        node = whole = json.loads(good)
        for key in path[:-1]:
            node = node[key]
        node[path[-1]] = WRONG[number % len(WRONG)]
        found += [json.dumps(whole), json.dumps(whole).replace("Infinity", "1e999")]
    return found


def assert_damage_is_read_or_refused(file: Path) -> None:
    for text in damaged(file.read_text()):
        file.write_text(text)
        try:
            again = Session.open(file)
        except UserError:
            continue
        again.save(file)
        assert Session.open(file).document.materials == again.document.materials


def test_damaged_documents_are_read_or_refused(tmp_path: Path) -> None:
    """Never another error; what is read is saved and read again."""
    one, file = session(), tmp_path / "edits.json"
    one.change("tray", with_node(TRAY, SHAPE, 0, 2.0))
    one.merge("pot", "tray")
    one.save(file)
    assert_damage_is_read_or_refused(file)


def test_surroundings_say_what_an_environment_says() -> None:
    values = {"file": "sky.hdr", "scale": 2.0, "rotation_deg": 30.0, "layout": "cross", "up": "-z"}
    assert set(values) == {field.name for field in fields(ImageEnvironment)} == set(Surroundings.model_fields)
    assert ImageEnvironment(**Surroundings(**values).model_dump()) == ImageEnvironment(**values)
    with pytest.raises(ValueError, match="layout"):
        Surroundings(file="sky.hdr", layout="round")


def test_a_material_is_merged_with_another_and_parted_again(tmp_path: Path) -> None:
    paint = Material(kd=0.5)
    one = Session.new("room", CAMERA, {name: paint for name in ("wall", "door", "frame")})
    one.change("wall", Material(kd=0.8))
    one.merge("frame", "door")
    one.merge("door", "wall")
    assert [*one.document.materials] == ["wall"] and one.document.merged == {"frame": "wall", "door": "wall"}
    one.save(tmp_path / "room.edits.json")
    assert Session.open(tmp_path / "room.edits.json").document == one.document
    one.undo()
    assert [*one.document.materials] == ["wall", "door"] and one.document.merged == {"frame": "door"}
    for material, other in (("wall", "wall"), ("wall", "floor"), ("floor", "wall"), ("frame", "wall")):
        with pytest.raises(UserError, match="unknown material"):
            one.merge(material, other)
    both = one.document.model_dump(mode="json") | {"merged": {"door": "wall"}}
    (tmp_path / "both.edits.json").write_text(json.dumps(both))
    with pytest.raises(UserError, match=r"'door' is merged"):
        Session.open(tmp_path / "both.edits.json")
