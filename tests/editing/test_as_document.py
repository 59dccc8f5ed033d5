"""Edited curves as documents: curve lobes where these follow, fitted lobes elsewhere, and the error."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from lambent.core.plain import triple
from lambent.editing.session import as_document as conversion
from lambent.editing.session.as_document import EditedTable, as_document
from lambent.materials.document import Lobe, Material, Provenance
from lambent.materials.factored.curve import Curve, angles_rad
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import editable
from lambent.materials.factored.terms import Editable
from lambent.materials.fitting.account import evaluate
from lambent.materials.lobes import widths
from lambent.materials.measured.inspecting.metrics import errors_and_shares
from lambent.materials.measured.protocol import MeasuredSamples
from lambent.materials.models import model_named
from tests.materials.test_curve_lobes import KD_CURVE, curve_lobe

ROUND = Lobe(mx=0.15, my=0.15, k=(0.8, 0.7, 0.6), r0=0.3)
BRUSHED = Lobe(mx=0.1, my=0.3, k=0.5, r0=0.2, distribution="beckmann")
THROUGH = Lobe(mx=0.2, my=0.2, k=0.5, r0=0.1, side="transmission")
FITTED = Material(kd=0.1, lobes=(Lobe(mx=0.4, my=0.4),))


@pytest.fixture
def fitted(monkeypatch: pytest.MonkeyPatch) -> list[MeasuredSamples]:
    """Fits take no time; they are recorded, and always find `FITTED`."""
    found: list[Editable] = []
    monkeypatch.setattr(
        conversion, "fit", lambda samples, **_: found.append(samples) or SimpleNamespace(material=FITTED)
    )
    return found


def with_values(made: Editable, name: str, by: object) -> Editable:
    """A curve times a number, a colour or values at its knots."""
    return made.with_curve(name, Curve(made.curves[name].values * np.asarray(by)))


def tinted(made: Editable, name: str, colour: object) -> Editable:
    terms = (replace(t, scale=triple(np.multiply(t.scale, colour))) if t.name == name else t for t in made.terms)
    return replace(made, terms=tuple(terms))


def converted(material: Material, edited: Editable) -> Material:
    """The document of edited curves, which no fit made."""
    found = as_document("it", material, of_material(material), edited)
    assert found.provenance is not None and found.provenance.method == "edited curves"
    return found


def l1_share(material: Material, expected: Editable) -> float:
    samples = EditedTable(expected, "it").samples(20_000)
    return errors_and_shares(samples, evaluate(material, samples))[1]["l1"]


@pytest.mark.parametrize(
    "material",
    [
        Material(kd=(0.3, 0.2, 0.1), lobes=(ROUND,)),
        Material(kd=0.2, kd_coupled=True, lobes=(ROUND, BRUSHED)),
        Material(kt_d=0.3, lobes=(THROUGH, ROUND)),
        Material(kd=0.2, kd_curve=KD_CURVE, lobes=(curve_lobe(mx=0.2, my=0.1),)),
    ],
)
def test_without_edits_the_document_comes_back(material: Material, fitted: list[MeasuredSamples]) -> None:
    found = converted(material, of_material(material))
    assert found.model_copy(update={"name": "material", "provenance": None}) == material
    assert l1_share(found, of_material(material)) < 1e-3 and not fitted


def test_curves_that_are_multiples_stay_exact(fitted: list[MeasuredSamples]) -> None:
    """A whole curve amplified is a colour; both terms of a brushed lobe share the curve."""
    material = Material(kd=0.2, lobes=(BRUSHED,))
    edited = with_values(with_values(of_material(material), "highlight along", (0.5, 1.0, 1.0)), "diffuse", 2.0)
    found = converted(material, edited)
    assert np.allclose(found.lobes[0].k, [0.25, 0.5, 0.5]) and found.lobes[0].distribution == "beckmann"
    assert np.allclose(found.kd, 0.8), "the curve counts for both directions"
    assert l1_share(found, edited) < 1e-3 and not fitted


def test_two_colours_of_one_lobe_are_no_lobe(fitted: list[MeasuredSamples]) -> None:
    material = Material(kd=0.2, lobes=(BRUSHED,))
    found = as_document("it", material, start := of_material(material), tinted(start, "grazing", 0.5))
    assert found.provenance is not None and len(fitted) == 1
    assert found.provenance.method == "edited curves; lobes fitted to specular, grazing"
    assert found.lobes == FITTED.lobes and np.allclose(found.kd, 0.3), "what was kept, and what was fitted"
    assert found.provenance.errors["l1"] > 0.01 and found.provenance.metric == "cuberoot"


def test_what_was_edited_becomes_a_curve_lobe_and_the_rest_stays() -> None:
    """The edit makes a lobe's highlight that of a rougher lobe."""
    material = Material(kd=(0.3, 0.2, 0.1), lobes=(BRUSHED, ROUND))
    rougher = of_material(Material(lobes=(ROUND.model_copy(update={"mx": 0.25, "my": 0.25}),))).curves["highlight"]
    edited = of_material(material).with_curve("lobe 2 highlight", rougher)
    found = converted(material, edited)
    assert found.lobes[0] == BRUSHED and found.kd == material.kd
    assert found.lobes[1].distribution == "curve" and widths(found.lobes[1])[0] == pytest.approx(0.25, rel=0.02)
    assert l1_share(found, edited) < 0.02


@pytest.mark.long
def test_a_curve_lobe_is_edited_without_a_fit(fitted: list[MeasuredSamples]) -> None:
    material = Material(
        kd=0.2, kd_curve=KD_CURVE, lobes=(curve_lobe(mx=0.2, my=0.1), curve_lobe(mx=0.3, my=0.3, side="transmission"))
    )
    edited = of_material(material)
    for name, by in (("lobe 1 highlight", 1.5), ("lobe 2 fresnel", 0.7), ("diffuse", 1.2)):
        edited = with_values(edited, name, 1 + (by - 1) * np.linspace(0, 1, len(angles_rad()))[:, None])
    found = converted(material, edited)
    assert l1_share(found, edited) < 0.03 < 0.05 < l1_share(material, edited) and not fitted
    assert converted(found, of_material(found)).lobes == found.lobes


@pytest.mark.parametrize("coupled", [False, True])
def test_a_diffuse_curve_is_that_of_the_document(coupled: bool) -> None:
    """It counts for both directions; a coupled term's fall towards grazing becomes part of it."""
    material = Material(kd=(0.5, 0.3, 0.1), kd_coupled=coupled, lobes=(ROUND,))
    edited = with_values(of_material(material), "diffuse", np.linspace(1.2, 0.6, len(angles_rad()))[:, None])
    found = converted(material, edited)
    assert found.kd_curve is not None and not found.kd_coupled and found.lobes == (ROUND,)
    assert l1_share(found, edited) < 0.08 < l1_share(material, edited)
    assert converted(found, of_material(found)).kd_curve == found.kd_curve


def test_a_ring_about_the_highlight_is_a_curve_lobe() -> None:
    material = Material(lobes=(ROUND,))
    ring = Curve.of(lambda x: 20 * np.exp(-(((x - 0.6) / 0.2) ** 2)))
    edited = of_material(material)
    edited = edited.with_curve("highlight", Curve(edited.curves["highlight"].values + ring.values))
    found = converted(material, edited)
    assert found.lobes[0].distribution == "curve" and l1_share(found, edited) < 0.1 < l1_share(material, edited)


def test_channels_of_a_highlight_that_are_no_multiples_are_fitted(fitted: list[MeasuredSamples]) -> None:
    material = Material(lobes=(ROUND,))
    start = of_material(material)
    slope = np.linspace(1, 0, len(angles_rad()))[:, None]
    as_document("it", material, start, with_values(start, "highlight", slope ** np.array([1.0, 2.0, 4.0])))
    assert len(fitted) == 1


def test_provenance_stays_and_has_the_error_of_the_edit() -> None:
    measured = Provenance(source="foil.bsdf", source_format="tensor tree", method="fit", notes=("3 lobes tried",))
    material = Material(kd=0.2, lobes=(ROUND,), provenance=measured)
    edited = tinted(of_material(material), "specular", 0.5)
    provenance = converted(material, edited).provenance
    assert provenance is not None and (provenance.source, provenance.notes) == (measured.source, measured.notes)
    samples = EditedTable(edited, "it").samples(conversion.COMPARED)
    assert provenance.samples == samples.counts and max(provenance.errors.values()) < 1e-3


def test_black_materials_have_no_lobes() -> None:
    ward = editable(model_named("ward")())
    found = as_document("it", None, ward, tinted(ward, "specular", 0.0))
    assert not found.lobes and not any(found.kd)


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
