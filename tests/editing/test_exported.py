"""Edited materials as documents: exact where they can be, fitted with the error shown elsewhere."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.views.camera import Camera
from lambent.editing.curves.operators import Operator, Region
from lambent.editing.session.exported import EditedTable, export
from lambent.editing.session.session import Session
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material, Provenance, load_material
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import editable
from lambent.materials.lobes import widths
from lambent.materials.models import model_named
from tests.materials.test_curve_lobes import KD_CURVE, curve_lobe

CAMERA = Camera("view", (0.0, 1.0, 3.0), (0.0, 0.0, 0.0))
ROUND = Lobe(mx=0.15, my=0.15, k=(0.8, 0.7, 0.6), r0=0.3)
BRUSHED = Lobe(mx=0.1, my=0.3, k=0.5, r0=0.2, distribution="beckmann")
THROUGH = Lobe(mx=0.2, my=0.2, k=0.5, r0=0.1, side="transmission")
WIDE = Region(a=-1.0, b=-0.5, c=2.0, d=3.0)


def session(start: object) -> Session:
    return Session.new("room", CAMERA, {"it": start})


def close_to(one: Session, material: Material, tolerance: float = 3e-3) -> bool:
    samples = EditedTable(one.editable("it"), "it").samples(4000)
    expected, found = samples.f, MaterialBSDF(material).eval(samples.wi, samples.wo)
    return bool(np.allclose(found, expected, rtol=tolerance, atol=tolerance * 0.1 * expected.max()))


@pytest.mark.parametrize(
    "material",
    [
        Material(kd=(0.3, 0.2, 0.1), lobes=(ROUND,)),
        Material(kd=0.2, kd_coupled=True, lobes=(ROUND, BRUSHED)),
        Material(kt_d=0.3, lobes=(THROUGH, ROUND)),
    ],
)
def test_without_edits_the_document_comes_back(material: Material) -> None:
    found = export(session(material), "it")
    assert found.material.model_dump(exclude={"provenance", "name"}) == material.model_dump(
        exclude={"provenance", "name"}
    )
    assert not found.fitted
    assert found.verdict.word == "faithful"
    assert max(found.shares.values()) < 1e-3


def test_parameters_and_colours_stay_exact() -> None:
    one = session(model_named("kurt")(mx=0.1, my=0.1, k=0.5))
    one.set("it", mx=0.23, my=0.23, r0=(0.2, 0.4, 0.6))
    one.tint("it", "specular", (1.0, 0.5, 0.25))
    found = export(one, "it")
    lobe = Lobe(mx=0.23, my=0.23, r0=(0.2, 0.4, 0.6), k=(0.5, 0.25, 0.125), alpha=0)
    assert found.material.lobes == (lobe,)
    assert not found.fitted


def test_curves_that_are_multiples_stay_exact() -> None:
    """A whole curve amplified is a colour; both terms of a brushed lobe share the curve."""
    one = session(Material(kd=0.2, lobes=(BRUSHED,)))
    one.apply("it", "highlight along", Operator(kind="amplify_y", region=WIDE, size=0.5, channels=(0,)))
    one.apply("it", "diffuse", Operator(kind="translate_y", region=WIDE, size=1.0))
    found = export(one, "it")
    assert not found.fitted
    assert np.allclose(found.material.lobes[0].k, [0.25, 0.5, 0.5])
    assert np.allclose(found.material.kd, 0.8)  # the curve counts for both directions
    assert close_to(one, found.material)


def test_two_tints_of_one_lobe_are_no_lobe() -> None:
    one = session(Material(lobes=(BRUSHED,)))
    one.tint("it", "grazing", 0.5)
    assert export(one, "it", lobes=1).fitted == ("specular", "grazing")


def test_what_was_edited_becomes_a_curve_lobe_and_the_rest_stays() -> None:
    """The edit makes a lobe's highlight that of a rougher lobe."""
    material = Material(kd=(0.3, 0.2, 0.1), lobes=(BRUSHED, ROUND))
    rougher = of_material(Material(lobes=(ROUND.model_copy(update={"mx": 0.25, "my": 0.25}),))).curves["highlight"]
    one = session(material)
    one.draw("it", "lobe 2 highlight", rougher)
    found = export(one, "it")
    assert found.fitted == () and found.material.lobes[0] == BRUSHED
    assert (found.material.lobes[1].distribution, widths(found.material.lobes[1])[0]) == (
        "curve",
        pytest.approx(0.25, rel=0.02),
    )
    assert found.material.kd == material.kd and found.verdict.word == "faithful"
    assert close_to(one, found.material, 0.05)


def test_a_curve_lobe_is_opened_and_closed_without_a_fit() -> None:
    """Pulling a curve at the nodes of the document changes these alone; the document that was not edited stays."""
    material = Material(
        kd=0.2, kd_curve=KD_CURVE, lobes=(curve_lobe(mx=0.2, my=0.1), curve_lobe(mx=0.3, my=0.3, side="transmission"))
    )
    one = session(material)
    same = export(one, "it")
    assert same.fitted == () and same.material.model_copy(update={"name": "material", "provenance": None}) == material
    for name, by in (("lobe 1 highlight", 1.5), ("lobe 2 fresnel", 0.7), ("diffuse", 1.2)):
        values = one.editable("it").curves[name].values
        angle = np.linspace(0, 1, len(values))[:, None]
        one.draw("it", name, Curve(values * (1 + (by - 1) * angle)))
    found = export(one, "it")
    assert found.fitted == () and found.verdict.word == "faithful" and found.shares["l1"] < 0.03
    again = session(found.material)
    assert export(again, "it").material.lobes == found.material.lobes


@pytest.mark.parametrize("coupled", [False, True])
def test_a_diffuse_curve_is_that_of_the_document(coupled: bool) -> None:
    """It counts for both directions; a coupled term's fall towards grazing becomes part of it."""
    one = session(Material(kd=(0.5, 0.3, 0.1), kd_coupled=coupled, lobes=(ROUND,)))
    values = one.editable("it").curves["diffuse"].values
    one.draw("it", "diffuse", Curve(values * np.linspace(1.2, 0.6, len(values))[:, None]))
    found = export(one, "it")
    assert found.fitted == () and found.material.kd_curve is not None and not found.material.kd_coupled
    assert found.material.lobes == (ROUND,) and found.shares["l1"] < 0.08
    assert export(session(found.material), "it").material.kd_curve == found.material.kd_curve


def test_a_ring_about_the_highlight_is_a_curve_lobe() -> None:
    one = session(Material(lobes=(ROUND,)))
    one.pull("it", "highlight", Region(a=0.4, b=0.55, c=0.7, d=0.85), y=20.0)
    found = export(one, "it")
    assert found.fitted == () and found.verdict.word == "approximate"


def test_what_no_lobe_can_follow_is_said() -> None:
    """A ring about a brushed highlight along one slope alone."""
    one = session(Material(lobes=(BRUSHED,)))
    one.pull("it", "highlight along", Region(a=0.5, b=0.55, c=0.6, d=0.65), y=60.0)
    found = export(one, "it", lobes=1)
    assert found.fitted and found.verdict.word != "faithful"


def test_models_without_a_document_are_fitted() -> None:
    found = export(session(model_named("ward")(mx=0.2, my=0.2)), "it", lobes=1, distribution="beckmann")
    assert found.fitted == ("specular",)
    assert found.material.lobes[0].mx == pytest.approx(0.2, rel=0.05)


def test_provenance_says_what_it_came_from(tmp_path: Path) -> None:
    measured = Provenance(source="foil.bsdf", source_format="tensor tree", notes=("3 lobes tried",))
    one = session(Material(kd=0.2, lobes=(ROUND,), provenance=measured))
    one.tint("it", "specular", 0.5)
    found = export(one, "it")
    found.material.save(tmp_path / "it.json")
    provenance = load_material(tmp_path / "it.json").provenance
    assert provenance.source == "foil.bsdf"
    assert provenance.method == "edited: colour of specular; exact"
    assert provenance.errors == found.errors
    assert str(found.verdict) in provenance.notes
    assert "before the edits: 3 lobes tried" in provenance.notes


def test_black_materials_are_exported() -> None:
    one = session(model_named("ward")())
    one.tint("it", "specular", 0.0)
    assert not export(one, "it").material.lobes


@pytest.mark.parametrize(
    ("made", "isotropic"),
    [
        (of_material(Material(kd=0.2, lobes=(ROUND, THROUGH))), True),
        (of_material(Material(lobes=(BRUSHED,))), False),
        (of_material(Material(lobes=(THROUGH.model_copy(update={"mx": 0.05}),))), False),
        (editable(model_named("schlick")(p=0.3)), False),
        (editable(model_named("ashikhmin-shirley")(ex=20, ey=20)), True),
        (editable(model_named("ggx")(alpha_x=0.1, alpha_y=0.11)), False),
    ],
)
def test_tables_know_whether_they_are_isotropic(made: object, isotropic: bool) -> None:
    assert EditedTable(made, "it").info.isotropic == isotropic


def test_tuples_cover_the_hemisphere() -> None:
    """Weights are solid angles of outgoing directions: for each incident one, the cosine integrates to pi."""
    for curve in (Curve.constant(), Curve.of(lambda x: np.exp(-((x / 0.01) ** 2)))):
        start = of_material(Material(lobes=(ROUND,))).with_curve("highlight", curve)
        samples = EditedTable(start, "it").samples()
        for theta in (0.0, 30.0, 60.0):
            here = np.isclose(samples.wi[:, 2], np.cos(np.radians(theta)))
            covered = float(samples.weight[here] @ samples.wo[here, 2])
            assert covered == pytest.approx(np.pi, rel=0.03)


def test_tuples_are_dense_where_a_curve_is_steep() -> None:
    start = of_material(Material(lobes=(ROUND,)))
    ring = Curve.of(lambda x: np.exp(-(((x - 0.6) / 0.002) ** 2)))
    h = [EditedTable(one, "it").samples() for one in (start, start.with_curve("highlight", ring))]
    near = [
        int((np.abs(np.arccos((w := s.wi + s.wo)[:, 2] / np.linalg.norm(w, axis=1)) - 0.6) < 0.004).sum()) for s in h
    ]
    assert near[1] > 5 * near[0]
