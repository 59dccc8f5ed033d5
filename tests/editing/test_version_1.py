"""Sessions of version 1: their operators, and the documents that their materials become."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from lambent.core.errors import UserError
from lambent.core.inputs import sha256_of
from lambent.core.plain import triple
from lambent.editing.session import as_document as conversion
from lambent.editing.session import version_1
from lambent.editing.session.as_document import EditedTable
from lambent.editing.session.document import EditedMaterial
from lambent.editing.session.session import Session
from lambent.editing.session.version_1 import CurveEdit, Operator, Region, smooth_step
from lambent.materials.document import Lobe, Material, Provenance
from lambent.materials.factored.curve import Curve, angles_rad
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import editable
from lambent.materials.factored.terms import Editable
from lambent.materials.fitting.account import evaluate
from lambent.materials.measured.inspecting.metrics import errors_and_shares
from lambent.materials.measured.inspecting.synthetic import Setup, synthesise
from lambent.materials.measured.parts.gonio_text import write_gonio
from lambent.materials.models import model_named
from lambent.store.kept.session import FILE, WalkSession, write_session
from tests.editing.test_session import CAMERA, assert_damage_is_read_or_refused
from tests.materials.test_curve_lobes import KD_CURVE, curve_lobe

TRAY = Material(name="tray", kd=(0.3, 0.2, 0.1), lobes=(Lobe(mx=0.1, my=0.1),))
BRUSHED = Material(name="tray", kd=0.2, lobes=(Lobe(mx=0.1, my=0.3, distribution="beckmann"),))
LOW = {"a": -0.2, "b": 0.0, "c": 0.1, "d": 0.3}
WIDE = {"a": -1.0, "b": -0.5, "c": 2.0, "d": 3.0}
REGION = Region(a=0.3, b=0.5, c=0.7, d=1.0)
HUMP = Curve.of(lambda x: 1 + np.exp(-(((x - 0.6) / 0.1) ** 2)))
X = angles_rad()
FITTED = SimpleNamespace(material=Material(kd=0.1))
SHORT = Setup((0.0, 30.0, 60.0), step_deg=20, fine_deg=10, noise=0.0, floor=0.0)


@pytest.fixture(autouse=True)
def _few_tuples(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fits take seconds instead of minutes."""
    monkeypatch.setattr(conversion, "RINGS", 16)
    monkeypatch.setattr(conversion, "SECTORS", 4)


def layer(kind: str, size: float, region: Mapping[str, float] = LOW, channels: tuple[int, ...] = (0, 1, 2)) -> Any:
    return {"kind": kind, "region": dict(region), "size": size, "base": 0.0, "channels": list(channels)}


def layers(*one: Any) -> Any:
    return {"drawn": None, "layers": list(one)}


def drawn(angles: list[float], values: list[Any]) -> Any:
    return {"drawn": {"angle_rad": angles, "values": values}, "layers": []}


def material_of(source: Any, curves: Any = None, tints: Any = None) -> Any:
    return {"source": source, "curves": curves or {}, "tints": tints or {}}


def of_document(material: Material) -> Any:
    return {"kind": "document", "material": material.model_dump(mode="json")}


def of_model(name: str, **parameters: Any) -> Any:
    return {"kind": "model", "model": name, "parameters": parameters}


def of_table(file: Path) -> Any:
    return {"kind": "table", "file": file.name, "sha256": sha256_of(file)}


def written(folder: Path, materials: Any, /, **more: Any) -> Path:
    """A file as version 1 wrote it."""
    data = {
        "format": "lambent-edit-session", "version": 1, "scene": "room",
        "camera": {
            "name": "view", "position": [0.0, 1.0, 3.0], "target": [0.0, 0.0, 0.0], "up": [0.0, 1.0, 0.0],
            "fov_y_deg": 45.0,
        },
        "size": [512, 512], "environment": None, "lights": 400, "materials": materials, "merged": {},
        "crease_deg": None,
    }  # fmt: skip
    (folder / "old.edits.json").write_text(json.dumps(data | more, indent=1) + "\n")
    return folder / "old.edits.json"


def opened(folder: Path, source: Any, curves: Any = None, tints: Any = None) -> EditedMaterial:
    return Session.open(written(folder, {"tray": material_of(source, curves, tints)})).material("tray")


def l1_share(material: Material, expected: Editable) -> float:
    """L1 of a document relative to curves."""
    samples = EditedTable(expected, "it").samples()
    return errors_and_shares(samples, evaluate(material, samples))[1]["l1"]


def with_curve(material: Material, name: str, edit: Any) -> Editable:
    """The curves of a document, one of them edited."""
    start = of_material(material)
    return start.with_curve(name, CurveEdit.model_validate(edit).applied(start.curves[name]))


def test_step_is_smooth_and_symmetric() -> None:
    t = np.linspace(-0.5, 1.5, 20_001)
    step = smooth_step(t)
    assert step[0] == 0 and step[-1] == 1
    assert np.allclose(step + step[::-1], 1)
    assert np.gradient(step, t).min() >= 0
    for end in (0.0, 1.0):  # all derivatives vanish at the ends: the step is flatter there than any power
        near = np.abs(smooth_step(end + np.array([0.05, -0.05])) - end)
        assert near.max() < 1e-30


def test_operators_change_nothing_outside_of_their_region_and_channels() -> None:
    outside = REGION.weight(X) == 0
    for kind, size in (("translate_y", 0.7), ("amplify_y", 3.0), ("translate_x", 0.05), ("amplify_x", 1.2)):
        edited = Operator(kind=kind, region=REGION, size=size, base=0.6, channels=(1,)).applied(HUMP).values
        assert np.array_equal(edited[outside], HUMP.values[outside])
        assert np.array_equal(edited[:, ::2], HUMP.values[:, ::2]) and not np.allclose(edited[:, 1], HUMP.values[:, 1])


def test_operators_do_as_their_names_say() -> None:
    inside = REGION.weight(X) == 1
    up = Operator(kind="translate_y", region=REGION, size=0.7).applied(HUMP)
    assert np.allclose(up.values[inside], HUMP.values[inside] + 0.7)
    more = Operator(kind="amplify_y", region=REGION, size=3, base=1).applied(HUMP)
    assert np.allclose(more.values[inside], 1 + 3 * (HUMP.values[inside] - 1))
    assert Operator(kind="translate_y", region=REGION, size=-9).applied(HUMP).values.min() == 0
    moved = Operator(kind="translate_x", region=REGION, size=0.05).applied(HUMP)
    assert X[moved.values[:, 0].argmax()] == pytest.approx(0.65, abs=1e-3)
    assert moved.values.max() == pytest.approx(HUMP.values.max(), rel=1e-5)
    wide = Region(a=0.0, b=0.2, c=1.0, d=1.4)
    wider = Operator(kind="amplify_x", region=wide, size=1.5, base=0.6).applied(HUMP)
    assert np.allclose(wider.at(np.array([0.6, 0.75])), HUMP.at(np.array([0.6, 0.7])), rtol=1e-4)


@pytest.mark.parametrize("ends", [(0, 0, 1, 2), (0, 1, 0.5, 2), (0, 1, 2, 2), (0, 1, 2, float("nan"))])
def test_regions_are_in_order(ends: tuple[float, ...]) -> None:
    with pytest.raises(ValidationError):
        Region(**dict(zip("abcd", ends, strict=True)))


def test_layers_make_the_curves_that_version_1_made() -> None:
    """Figures of that version: a highlight lifted and moved, a Fresnel curve edited by all kinds of operators."""
    curves = of_material(TRAY).curves
    edit = layers(layer("translate_y", 2.0), layer("translate_x", 0.05))
    highlight = CurveEdit.model_validate(edit).applied(curves["highlight"]).at(np.array([0, 0.05, 0.1, 0.2, 0.25]))
    expected = [3.38309886e01, 3.38308806e01, 2.69038399e01, 3.00030948e00, 1.26187440e-01]
    np.testing.assert_allclose(highlight, np.array(expected)[:, None] * np.ones(3), rtol=1e-8)
    lifted = layer("translate_y", 0.3, {"a": 0.5, "b": 0.7, "c": 0.8, "d": 1.2}, (0, 2))
    wider = layer("amplify_x", 1.2, {"a": -0.5, "b": 0.0, "c": 1.5, "d": 2.0}) | {"base": 0.2}
    more = layer("amplify_y", 3.0, {"a": -0.5, "b": 0.0, "c": 0.1, "d": 0.5}) | {"base": 0.02}
    edit = CurveEdit.model_validate(layers(lifted, wider, more))
    fresnel = edit.applied(curves["fresnel"]).at(np.array([0.1, 0.2, 0.25, 0.9]))
    expected_f = [[0.08] * 3, [0.07888904] * 3, [0.07029091] * 3, [0.34201827, 0.04201827, 0.34201827]]
    np.testing.assert_allclose(fresnel, expected_f, rtol=1e-6)


@pytest.mark.parametrize(
    "material",
    [
        TRAY.model_copy(update={"provenance": Provenance(source="tray.bsdf", notes=("3 lobes tried",))}),
        Material(name="other", kd=1 / 3, kd_coupled=True, lobes=(Lobe(mx=0.1, my=0.3, alpha=0.5), *TRAY.lobes)),
        Material(kd=0.2, kd_curve=KD_CURVE, lobes=(curve_lobe(mx=0.3, my=0.3, side="transmission"),)),
    ],
)
def test_without_edits_the_document_comes_back(material: Material, tmp_path: Path) -> None:
    found = opened(tmp_path, of_document(material))
    assert found.now == found.start == material


def test_the_rest_of_a_session_comes_as_it_is(tmp_path: Path) -> None:
    around = {"file": "sky.hdr", "scale": 2.0, "rotation_deg": 30.0, "layout": None, "up": "-z"}
    more = {"size": [40, 30], "environment": around, "lights": 1000, "merged": {"door": "tray"}, "crease_deg": 30.0}
    file = written(tmp_path, {"tray": material_of(of_document(TRAY))}, **more)
    before, session = file.read_bytes(), Session.open(file)
    found = session.document
    assert found.camera == CAMERA and found.scene == "room" and found.version == 2
    dumped = found.model_dump(mode="json")
    assert {key: dumped[key] for key in more} == more
    assert file.read_bytes() == before, "nothing is written before somebody saves"
    session.save(file)
    assert Session.open(file).document == found and json.loads(file.read_text())["version"] == 2


@pytest.mark.parametrize(
    ("edit", "share"),
    [
        (layers(layer("translate_y", 1.0, {"a": 0.03, "b": 0.1, "c": 0.15, "d": 0.4})), 0.005),
        (layers(layer("translate_y", 2.0), layer("translate_x", 0.05)), 0.015),
    ],
)
def test_a_pulled_highlight_is_a_curve_lobe(
    edit: Any, share: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As close as 32 nodes can follow: of the second, the flank has been moved to where these lie apart."""
    monkeypatch.undo()
    found = opened(tmp_path, of_document(TRAY), {"highlight": edit})
    assert found.start == TRAY and found.now.name == "tray" and found.now.kd == TRAY.kd
    (lobe,) = found.now.lobes
    assert lobe.distribution == "curve" and (lobe.mx, lobe.my, lobe.alpha) == (0.1, 0.1, 0.0)
    expected = with_curve(TRAY, "highlight", edit)
    assert l1_share(found.now, expected) < share < 0.2 * l1_share(TRAY, expected)
    assert found.now.provenance is not None and found.now.provenance.method == "edited curves"
    assert 0 < found.now.provenance.errors["l1"] < 0.0005 and found.now.provenance.metric is None


def test_a_drawn_curve_has_channels_of_its_own(tmp_path: Path) -> None:
    """The nodes of Fresnel's curve lie on what was drawn."""
    edit = drawn([0.0, 1.0, 1.5], [0.2, [0.5, 0.3, 0.1], 1.0])
    found = opened(tmp_path, of_document(TRAY), {"fresnel": edit})
    (lobe,) = found.now.lobes
    assert lobe.distribution == "curve" and found.start == TRAY
    angle = np.arccos(np.linspace(0, 1, 8))
    expected = [np.interp(angle, [0.0, 1.0, 1.5], [0.2, middle, 1.0]) for middle in (0.5, 0.3, 0.1)]
    norm = lobe.k[0] / max(expected[0])
    np.testing.assert_allclose(np.array(lobe.k)[:, None] * lobe.fresnel, norm * np.array(expected), rtol=1e-6)
    assert norm == pytest.approx(1.0, rel=0.02)


def test_an_operator_on_one_channel_leaves_the_others(tmp_path: Path) -> None:
    found = opened(tmp_path, of_document(TRAY), {"fresnel": layers(layer("amplify_y", 0.5, WIDE, (0,)))})
    (lobe,) = found.now.lobes
    np.testing.assert_allclose(np.array(lobe.k) / lobe.k[2], [0.5, 1.0, 1.0], rtol=1e-9)
    assert opened(tmp_path, of_document(TRAY)).now.lobes == TRAY.lobes


def test_colours_are_exact(tmp_path: Path) -> None:
    found = opened(tmp_path, of_document(TRAY), tints={"diffuse": [2.0, 1.0, 0.0], "specular": [0.5, 0.25, 1.0]})
    assert np.allclose(found.now.kd, (0.6, 0.2, 0.0), rtol=1e-12) and found.start == TRAY
    assert found.now.lobes == (TRAY.lobes[0].model_copy(update={"k": (0.5, 0.25, 1.0)}),)


@pytest.mark.parametrize("curve", ["pulled", "drawn"])
def test_a_coupled_diffuse_term_gets_a_curve_and_new_transport(curve: str, tmp_path: Path) -> None:
    coupled = TRAY.model_copy(update={"kd_coupled": True})
    wide = {"a": 0.2, "b": 0.7, "c": 1.0, "d": 1.6}
    edit = layers(layer("translate_y", 0.3, wide)) if curve == "pulled" else drawn([0.0, 1.5], [1.2, 0.7])
    found = opened(tmp_path, of_document(coupled), {"diffuse": edit})
    assert not found.now.kd_coupled and found.now.kd_curve is not None and found.now.lobes == TRAY.lobes
    assert found.start == found.now, "the term's quotient is another one"
    expected = with_curve(coupled, "diffuse", edit)
    assert l1_share(found.now, expected) < 0.08 < l1_share(coupled, expected)
    tinted = opened(tmp_path, of_document(coupled), tints={"diffuse": 0.5})
    assert tinted.now.kd_coupled and tinted.start == coupled and np.allclose(tinted.now.kd, (0.15, 0.1, 0.05))


@pytest.mark.long
def test_a_lobe_of_two_slopes_is_fitted_and_needs_new_transport(tmp_path: Path) -> None:
    edit = layers(layer("amplify_y", 0.5, {"a": 0.1, "b": 0.2, "c": 2.0, "d": 3.0}))
    found = opened(tmp_path, of_document(BRUSHED), {"highlight along": edit})
    assert found.now.kd == BRUSHED.kd and found.start == found.now != BRUSHED
    assert found.now.provenance is not None
    assert found.now.provenance.method == "edited curves; lobes fitted to specular, grazing"


def test_models_that_documents_hold_are_exact(tmp_path: Path) -> None:
    kurt = {"mx": 0.23, "my": 0.23, "r0": [0.2, 0.4, 0.6], "k": [0.5, 0.5, 0.5], "alpha": 0.0}
    found = opened(tmp_path, of_model("kurt", **kurt), tints={"specular": [1.0, 0.5, 0.25]})
    assert found.now.lobes == (Lobe(mx=0.23, my=0.23, r0=(0.2, 0.4, 0.6), k=(0.5, 0.25, 0.125), alpha=0),)
    found = opened(tmp_path, of_model("lambert", kd=[0.1, 0.2, 0.3]))
    assert found.now == found.start and found.now.kd == (0.1, 0.2, 0.3) and not found.now.lobes


@pytest.mark.long
def test_other_models_are_fitted_and_the_error_is_kept(tmp_path: Path) -> None:
    edit = layers(layer("amplify_y", 0.5, WIDE))
    found = opened(tmp_path, of_model("ward", mx=0.2, my=0.2), {"highlight": edit}, {"specular": [1.0, 0.5, 0.5]})
    ward = editable(model_named("ward")(mx=0.2, my=0.2))
    half = ward.with_curve("highlight", Curve(0.5 * ward.curves["highlight"].values))
    red = replace(half, terms=(replace(half.terms[0], scale=triple(half.terms[0].scale * np.array((1.0, 0.5, 0.5)))),))
    assert found.start == found.now and l1_share(found.now, red) < 0.02
    provenance = found.now.provenance
    assert provenance is not None and provenance.method == "edited curves; lobes fitted to specular"
    assert provenance.metric == "cuberoot" and 0 < provenance.errors["l1"] < 0.02


@pytest.mark.long
def test_a_measured_table_is_fitted(tmp_path: Path) -> None:
    known = Material(name="known", kd=0.3, lobes=(Lobe(mx=0.3, my=0.3, k=0.5),))
    write_gonio(file := tmp_path / "paint.txt", synthesise(known, SHORT))
    found = opened(tmp_path, of_table(file), tints={"diffuse": [0.5, 0.5, 0.5]})
    assert found.start == found.now and np.allclose(found.now.kd, 0.15, rtol=0.1)
    assert found.now.provenance is not None
    assert 0 < found.now.provenance.errors["l1"] < 0.01 and "diffuse, specular" in str(found.now.provenance.method)
    file.write_text(file.read_text() + "\n")
    changed = written(tmp_path, {"tray": material_of(of_table(file) | {"sha256": "0" * 64})})
    with pytest.raises(UserError, match=r"has changed since it was edited.*paint.txt|paint.txt.*has changed"):
        Session.open(changed)
    file.unlink()
    with pytest.raises(UserError, match=r"paint.txt.*materials.tray.source.file.*does not exist"):
        Session.open(changed)


def test_a_view_of_a_stores_session_is_read(tmp_path: Path) -> None:
    file = written(tmp_path, {"tray": material_of(of_document(TRAY), tints={"diffuse": 0.5})})
    view = {"document": json.loads(file.read_text())}
    write_session(tmp_path / FILE, WalkSession.model_validate({"edited": {"front": view}}))
    assert Session.open(tmp_path / f"{FILE}:front").material("tray").now.kd == pytest.approx((0.15, 0.1, 0.05))


REFUSED = {
    "curve": (of_model("phong"), {"fresnel": {}}, {}, r"materials.tray.curves.fresnel.*unknown curve"),
    "curve of a document": (of_document(TRAY), {"highlihgt": {}}, {}, r"curves.highlihgt.*did you mean 'highlight'"),
    "term": (of_document(TRAY), {}, {"difuse": 1.0}, r"materials.tray.tints.difuse.*did you mean 'diffuse'"),
    "colour": (of_document(TRAY), {}, {"diffuse": -1.0}, r"materials.tray.tints.diffuse"),
    "region": (
        of_document(TRAY), {"highlight": layers(layer("translate_y", 1.0, LOW | {"b": -0.3}))}, {},
        r"materials.tray.curves.highlight.layers.0.region.*a < b <= c < d",
    ),
    "kind": (of_document(TRAY), {"highlight": layers(layer("translate_z", 1.0))}, {}, r"layers.0.kind"),
    "stretch by 0": (of_document(TRAY), {"highlight": layers(layer("amplify_x", 0.0))}, {}, "materials.tray"),
    "points": (of_document(TRAY), {"highlight": drawn([0.1], [1.0, 2.0])}, {}, "materials.tray"),
    "no points": (of_document(TRAY), {"highlight": drawn([], [])}, {}, r"curves.highlight.drawn.angle_rad"),
    "key": (of_document(TRAY), {"highlight": {"layer": []}}, {}, r"curves.highlight.layer: unknown key"),
    "model": (of_model("fong"), {}, {}, r"materials.tray.*did you mean 'phong'"),
    "parameter": (of_model("phong", exponent=-1), {}, {}, "materials.tray.exponent"),
    "source": ({"kind": "documnet"}, {}, {}, r"materials.tray.source.kind"),
    "material": ({"kind": "document", "material": {"kdd": 1}}, {}, {}, r"materials.tray.source.material.kdd"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_used_is_refused_by_field(case: str, tmp_path: Path) -> None:
    source, curves, tints, named = REFUSED[case]
    with pytest.raises(UserError, match=named) as caught:
        opened(tmp_path, source, curves, tints)
    assert "old.edits.json" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("more", "named"),
    [
        ({"lihgts": 5}, r"lihgts: unknown key.*did you mean 'lights'"),
        ({"size": [10**5, 10**5]}, "pixels"),
        ({"materials": []}, "materials: has the wrong type"),
        ({"materials": None}, "materials: has the wrong type"),
        ({"merged": {"tray": "tray"}}, "'tray' is merged"),
    ],
)
def test_the_rest_is_checked_before_anything_is_fitted(
    more: Any, named: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(version_1, "as_document", None)
    file = written(tmp_path, {"tray": material_of(of_model("ward"))}, **more)
    with pytest.raises(UserError, match=named):
        Session.open(file)


@pytest.mark.long
def test_damaged_documents_are_read_or_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Never another error; without fits, which know nothing of the file."""
    curves = {"highlight": layers(layer("translate_y", 2.0), layer("amplify_x", 1.1)), "diffuse": drawn([0, 1], [1, 2])}
    materials = {
        "tray": material_of(of_document(TRAY), curves, {"specular": 0.5}),
        "pot": material_of(of_model("ward")),
    }
    monkeypatch.setattr(conversion, "fit", lambda *_, **__: FITTED)
    file = written(tmp_path, materials)
    assert_damage_is_read_or_refused(file)
