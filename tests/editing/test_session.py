"""Sessions: edits of curves, colours and parameters, undo, and the file they are saved in."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.editing.curves.operators import Operator, Region, translation
from lambent.editing.session.document import Drawn, Surroundings
from lambent.editing.session.session import Session
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.curve import Curve, angles_rad
from lambent.materials.factored.of_models import editable
from lambent.materials.models import model_named
from lambent.scenes.scene import ImageEnvironment
from tests.editing.test_operators import layered

CAMERA = Camera("view", (0.0, 1.0, 3.0), (0.0, 0.0, 0.0))
TRAY = Material(name="tray", kd=(0.3, 0.2, 0.1), lobes=(Lobe(mx=0.1, my=0.1),))
POT = model_named("cook-torrance")(m=0.15)
LOW, HIGH = Region(a=-0.2, b=0.0, c=0.1, d=0.3), Region(a=0.5, b=0.7, c=0.8, d=1.2)


def session() -> Session:
    return Session.new("room", CAMERA, {"tray": TRAY, "pot": POT})


def values(one: Session, material: str = "tray", curve: str = "highlight") -> np.ndarray:
    return one.editable(material).curves[curve].values


def test_without_edits_it_is_the_material() -> None:
    one = session()
    assert one.editable("pot").terms == editable(POT).terms
    assert np.array_equal(values(one, "pot"), editable(POT).curves["highlight"].values)


def test_a_pull_is_its_operators_and_is_undone() -> None:
    one = session()
    start = one.original("tray").curves["highlight"]
    one.pull("tray", "highlight", LOW, x=0.05, y=2.0, channels=(0, 2))
    expected = layered(start, translation(LOW, 0.05, 2.0, (0, 2)))
    assert np.array_equal(values(one), expected.values)
    assert np.array_equal(values(one)[:, 1], start.values[:, 1])
    one.undo()
    assert np.array_equal(values(one), start.values)
    one.redo()
    assert np.array_equal(values(one), expected.values)


def test_a_pull_that_would_fold_gets_room() -> None:
    one = session()
    one.pull("tray", "highlight", HIGH, x=0.3)
    assert one.document.materials["tray"].curves["highlight"].layers[0].region.a < 0.1


def test_layers_collapse_into_one_curve() -> None:
    one = session()
    for region in (LOW, HIGH):
        one.pull("tray", "highlight", region, y=1.5)
    before = values(one)
    one.collapse("tray", "highlight")
    edit = one.document.materials["tray"].curves["highlight"]
    assert not edit.layers
    assert np.allclose(values(one), before, rtol=1e-12)
    one.pull("tray", "highlight", HIGH, y=1)
    assert len(one.document.materials["tray"].curves["highlight"].layers) == 1
    one.undo()
    one.undo()
    assert len(one.document.materials["tray"].curves["highlight"].layers) == 2


def test_a_layer_is_taken_out() -> None:
    one = session()
    one.pull("tray", "highlight", LOW, y=1)
    one.pull("tray", "highlight", HIGH, y=2)
    one.remove("tray", "highlight", 0)
    assert one.document.materials["tray"].curves["highlight"].layers == translation(HIGH, 0, 2, (0, 1, 2))
    with pytest.raises(UserError, match="layer index out of range"):
        one.remove("tray", "highlight", 1)


def test_freehand_curves_replace_and_reset_restores() -> None:
    one = session()
    one.pull("tray", "highlight", LOW, y=1)
    one.draw("tray", "highlight", Drawn(angle_rad=(0.0, 1.0), values=(2.0, (0.0, 1.0, 3.0))))
    assert np.allclose(one.editable("tray").curves["highlight"].at(np.array(0.5)), [1, 1.5, 2.5])
    one.draw("tray", "highlight", Curve.of(np.cos))
    assert np.array_equal(values(one), Curve.of(np.cos).values)
    one.reset("tray", "highlight")
    assert one.document.materials["tray"].curves == {}


def test_parameters_make_new_curves_under_the_layers() -> None:
    one = session()
    operator = Operator(kind="amplify_y", region=LOW, size=2.0)
    one.apply("pot", "highlight", operator)
    assert one.set("pot", m=0.3)
    rougher = editable(model_named("cook-torrance")(m=0.3)).curves["highlight"]
    assert np.array_equal(values(one, "pot"), operator.applied(rougher).values)
    one.undo()
    assert np.array_equal(values(one, "pot"), operator.applied(editable(POT).curves["highlight"]).values)


def test_a_parameter_of_the_quotient_needs_new_transport() -> None:
    one = Session.new("room", CAMERA, {"cloth": model_named("ggx")(alpha_x=0.2, alpha_y=0.2)})
    assert one.set("cloth", f0=0.3)
    assert not one.set("cloth", alpha_x=0.4)


def test_edits_of_curves_that_are_gone_go_with_them() -> None:
    one = session()
    one.pull("tray", "highlight", LOW, y=1)
    one.tint("tray", "diffuse", 0.5)
    one.become("tray", TRAY.model_copy(update={"lobes": (Lobe(mx=0.1, my=0.3),)}))
    assert not one.document.materials["tray"].curves
    assert one.document.materials["tray"].tints == {"diffuse": (0.5, 0.5, 0.5)}
    one.undo()
    assert "highlight" in one.document.materials["tray"].curves


def test_colours_multiply_the_scales() -> None:
    one = session()
    one.tint("tray", "diffuse", (2.0, 1.0, 0.0))
    assert np.allclose(one.editable("tray").terms[0].scale, np.array([0.6, 0.2, 0]) / np.pi)
    one.tint("tray", "diffuse", 1.0)
    assert np.allclose(one.editable("tray").terms[0].scale, np.array(TRAY.kd) / np.pi)


def test_a_stroke_over_two_materials_is_one_step() -> None:
    one = session()
    with one.stroke():
        one.pull("tray", "highlight", LOW, y=1)
        one.set("pot", m=0.4)
    one.undo()
    assert one.document == session().document
    with pytest.raises(UserError), one.stroke():
        one.pull("tray", "highlight", LOW, y=1)
        one.pull("tray", "no such curve", LOW, y=1)
    assert one.document == session().document


def test_names_that_do_not_exist_are_refused() -> None:
    one = session()
    for edit in (
        lambda: one.pull("trya", "highlight", LOW, y=1),
        lambda: one.pull("tray", "highlihgt", LOW, y=1),
        lambda: one.tint("tray", "difuse", 1.0),
        lambda: one.set("pot", rouhgness=1.0),
        lambda: one.set("tray", m=0.2),
    ):
        with pytest.raises(UserError):
            edit()
    assert not one.history.can_undo


def test_edits_without_end_are_refused() -> None:
    one = session()
    for size in (1e300, 1e12):
        with pytest.raises(UserError, match="curve"):
            one.apply("tray", "highlight", Operator(kind="amplify_y", region=LOW, size=size))
    with pytest.raises(UserError):
        one.tint("tray", "diffuse", -1.0)
    with pytest.raises(UserError):
        one.tint("tray", "diffuse", float("nan"))


def test_a_session_is_saved_and_read(tmp_path: Path) -> None:
    one = session()
    one.pull("tray", "highlight", LOW, x=0.02, y=2)
    one.draw("tray", "diffuse", Drawn(angle_rad=(0.0, 1.0), values=(1.0, 0.5)))
    one.set("pot", m=0.31)
    one.tint("pot", "specular", (1.0, 0.5, 0.25))
    file = tmp_path / "edits.json"
    one.save(file)
    again = Session.open(file)
    assert again.document == one.document
    for name in ("tray", "pot"):
        a, b = one.editable(name), again.editable(name)
        assert a.terms == b.terms
        assert all(np.array_equal(a.curves[c].values, b.curves[c].values) for c in a.curves)


def test_collapsed_curves_survive_the_file_exactly(tmp_path: Path) -> None:
    one = session()
    one.pull("tray", "highlight", LOW, y=0.1)
    one.collapse("tray", "highlight")
    one.save(tmp_path / "edits.json")
    assert np.array_equal(values(Session.open(tmp_path / "edits.json")), values(one))


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


def test_a_table_is_made_into_curves_and_must_not_change(tmp_path: Path) -> None:
    table = tmp_path / "paint.binary"
    table.write_bytes(b"measured")
    factors = editable(POT)
    one = Session.new("room", CAMERA, {"paint": table}, factorise=lambda file: factors)
    one.pull("paint", "highlight", LOW, y=1)
    one.save(tmp_path / "edits.json")
    read: list[Path] = []
    Session.open(tmp_path / "edits.json", factorise=lambda file: read.append(file) or factors)
    assert [file.read_bytes() for file in read] == [b"measured"]
    table.write_bytes(b"another")
    with pytest.raises(UserError, match="has changed"):
        Session.open(tmp_path / "edits.json", factorise=lambda file: factors)
    with pytest.raises(UserError, match="file does not exist"):
        Session.new("room", CAMERA, {"paint": tmp_path / "none"})


def of_phong(curves: dict[str, object] | None = None, **more: object) -> dict[str, object]:
    return {"materials": {"a": {"source": {"kind": "model", "model": "phong", **more}, "curves": curves or {}}}}


REFUSED = {
    "unknown key": ({"lihgts": 5}, "lihgts"),
    "version": ({"version": 2}, "unsupported session version; found 2; expected 1; use the Lambent that wrote it"),
    "pixels": ({"size": [100000, 100000]}, "pixels"),
    "environment": ({"environment": {"file": "a.hdr", "scale": -1}}, "environment.scale"),
    "model": ({"materials": {"a": {"source": {"kind": "model", "model": "fong"}}}}, "materials.a"),
    "parameter": (of_phong(parameters={"exponent": -1}), "materials.a.exponent"),
    "curve": (of_phong(curves={"fresnel": {}}), "materials.a.curves.fresnel"),
    "points": (
        of_phong(curves={"highlight": {"drawn": {"angle_rad": [0.2, 0.1], "values": [1, 1]}}}),
        "highlight.drawn",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_documents_that_cannot_be_used_are_refused_by_field(case: str, tmp_path: Path) -> None:
    session().save(file := tmp_path / "edits.json")
    change, named = REFUSED[case]
    file.write_text(json.dumps({**json.loads(file.read_text()), **change}))
    with pytest.raises(UserError, match=named) as caught:
        Session.open(file)
    assert "edits.json" in str(caught.value)


@pytest.mark.parametrize("text", ["", "[]", "{}", "3", "[" * 100_000, "\xff", '{"format": NaN}'])
def test_other_files_are_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "edits.json").write_text(text, encoding="latin-1")
    with pytest.raises(UserError):
        Session.open(tmp_path / "edits.json")


def test_a_failed_save_leaves_the_file(tmp_path: Path) -> None:
    session().save(file := tmp_path / "edits.json")
    before = file.read_bytes()
    with pytest.raises(UserError):
        session().save(tmp_path)
    assert file.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["edits.json"]


def test_a_drag_computes_its_own_layer_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    one = session()
    for k in range(20):
        one.pull("tray", "highlight", LOW, y=0.1 * (k + 1))
    applied: list[Operator] = []
    real = Operator.applied
    monkeypatch.setattr(Operator, "applied", lambda self, curve: applied.append(self) or real(self, curve))
    with one.stroke():
        for k in range(1, 6):
            one.history.restart_stroke()
            one.pull("tray", "highlight", HIGH, y=0.01 * k)
            one.editable("tray")
    assert len(applied) == 5
    assert len(one.document.materials["tray"].curves["highlight"].layers) == 21
    assert len(angles_rad()) == len(values(one))


def places(node: object, at: tuple[object, ...] = ()) -> list[tuple[object, ...]]:
    """Every key of a parsed document, from the top."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    return [path for key, value in items for path in ((*at, key), *places(value, (*at, key)))]


def test_damaged_documents_are_read_or_refused(tmp_path: Path) -> None:
    """Any value of a session in place of any other: never another error."""
    one, file = session(), tmp_path / "edits.json"
    one.pull("tray", "highlight", LOW, x=0.02, y=2)
    one.draw("tray", "diffuse", Drawn(angle_rad=(0.0, 1.0), values=(1.0, 0.5)))
    one.tint("pot", "specular", 0.5)
    one.save(file)
    good = file.read_text()
    wrong = (None, -1, 0, 1e308, 10**400, "", "x" * 5000, [], {}, [1, 2, 3], True, "highlight", "..\x00")
    for number, path in enumerate(places(json.loads(good))):
        damaged = json.loads(good)
        node = damaged
        for key in path[:-1]:
            node = node[key]
        node[path[-1]] = wrong[number % len(wrong)]
        for text in (json.dumps(damaged), json.dumps(damaged).replace("Infinity", "1e999")):
            file.write_text(text)
            try:
                again = Session.open(file)
            except UserError:
                continue
            again.save(file)
            assert Session.open(file).document.materials == again.document.materials


def test_surroundings_say_what_an_environment_says() -> None:
    values = {"file": "sky.hdr", "scale": 2.0, "rotation_deg": 30.0, "layout": "cross", "up": "-z"}
    assert set(values) == {field.name for field in fields(ImageEnvironment)} == set(Surroundings.model_fields)
    assert ImageEnvironment(**Surroundings(**values).model_dump()) == ImageEnvironment(**values)
    with pytest.raises(ValueError, match="layout"):
        Surroundings(file="sky.hdr", layout="round")


def test_a_material_is_merged_with_another_and_parted_again(tmp_path: Path) -> None:
    paint = Material(kd=0.5)
    one = Session.new("room", CAMERA, {name: paint for name in ("wall", "door", "frame")})
    one.tint("wall", "diffuse", 2.0)
    one.merge("frame", "door")
    one.merge("door", "wall")
    assert [*one.document.materials] == ["wall"] and one.document.merged == {"frame": "wall", "door": "wall"}
    one.save(tmp_path / "room.edits.json")
    assert Session.open(tmp_path / "room.edits.json").document.merged == one.document.merged
    one.undo()
    assert [*one.document.materials] == ["wall", "door"] and one.document.merged == {"frame": "door"}
    for material, other in (("wall", "wall"), ("wall", "floor"), ("floor", "wall"), ("frame", "wall")):
        with pytest.raises(UserError, match="unknown material"):
            one.merge(material, other)
    both = one.document.model_dump(mode="json") | {"merged": {"door": "wall"}}
    (tmp_path / "both.edits.json").write_text(json.dumps(both))
    with pytest.raises(UserError, match=r"'door' is merged"):
        Session.open(tmp_path / "both.edits.json")
