"""Factors of measured tables: known products, models, noise, and the remainder that makes them the table."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.geometry.directions import FLIP_Z, Floats, direction
from lambent.materials.bsdf import MaterialBSDF, components
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.parametrisations import angle_of
from lambent.materials.factored.tabulated import Grid
from lambent.materials.factored.terms import Editable
from lambent.materials.fitting import factors
from lambent.materials.fitting.factors import MOST, Factored, factorise
from lambent.materials.fresnel import conductor
from lambent.materials.measured.protocol import MeasuredTable
from lambent.materials.models import model_named
from tests.materials.export.formula_table import Formula, FormulaTable
from tests.materials.export.formula_table import pairs_near_the_mirror as pairs

DEG = np.pi / 180


def angles_of(wi: Floats, wo: Floats) -> dict[str, Floats]:
    return {
        name: angle_of(name, components(wi), components(wo)) for name in ("theta_i", "theta_o", "theta_h", "theta_d")
    }


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Grids of an eighth and less of the nodes, for speed."""
    monkeypatch.setattr(factors, "KNOTS", {"theta_h": 60, "theta_d": 20, "theta_i": 16, "theta_o": 16})
    monkeypatch.setattr(factors, "FITTED", Grid(45, 24, 12, turns_d=2))
    monkeypatch.setattr(factors, "RATIOS", Grid(45, 24, 18))
    monkeypatch.setattr(factors, "FITTED_ANISOTROPIC", Grid(24, 12, 8, 8, turns_d=2))
    monkeypatch.setattr(factors, "RATIOS_ANISOTROPIC", Grid(24, 12, 16, 16))


def diffuse_and_highlight(wi: Floats, wo: Floats) -> Floats:
    a = angles_of(wi, wo)
    diffuse = 0.2 * np.cos(a["theta_i"]) ** 0.5 * (1 - 0.3 * np.sin(a["theta_o"]) ** 2)
    highlight = 4 * np.exp(-((a["theta_h"] / 0.2) ** 2)) * (0.1 + 0.9 * np.sin(a["theta_d"]) ** 4)
    return np.stack([diffuse + highlight, 0.5 * diffuse + highlight, 0 * diffuse], axis=-1)


def table_of(formula: Formula, channels: int = 3, **options: bool) -> FormulaTable:
    return FormulaTable(formula, channels=channels, isotropic=options.pop("isotropic", True), pairs=pairs(), **options)


def found(editable: Editable, name: str, angle_deg: Floats, channel: int = 0) -> Floats:
    return np.asarray(editable.curves[name].at(angle_deg * DEG)[:, channel])


def up_to_scale(one: Floats, other: Floats) -> float:
    """Largest relative difference of two curves that may differ in scale."""
    ratio = one / other
    return float(np.abs(ratio / np.median(ratio) - 1).max())


def sound(result: Factored) -> None:
    for curve in result.editable.curves.values():
        assert np.isfinite(curve.values).all()
        assert (curve.values >= 0).all()
    for term in result.editable.terms:
        low, high = term.quotient.range  # type: ignore[attr-defined]
        assert 0 <= low <= high <= MOST


@pytest.fixture(scope="module")
def known() -> Factored:
    return factorise(table_of(diffuse_and_highlight))


def test_known_products_are_recovered(known: Factored) -> None:
    """Each curve to 1 % of the known one, up to a scale, where the product carries light."""
    sound(known)
    assert [term.name for term in known.editable.terms] == ["diffuse", "specular"]
    x = np.arange(2.0, 70)
    for channel in (0, 1):
        wide, narrow, grazing = x, np.arange(1.0, 20), np.arange(2.0, 75)
        expected = {
            "diffuse": (wide, np.cos(wide * DEG) ** 0.5),
            "diffuse viewer": (wide, 1 - 0.3 * np.sin(wide * DEG) ** 2),
            "highlight": (narrow, np.exp(-((narrow * DEG / 0.2) ** 2))),
            "fresnel": (grazing, 0.1 + 0.9 * np.sin(grazing * DEG) ** 4),
        }
        for name, (at, truth) in expected.items():
            assert up_to_scale(found(known.editable, name, at, channel), truth) < 0.01, (name, channel)
    assert known.without_quotient["l1"] < 0.01


def test_a_black_channel_stays_black(known: Factored) -> None:
    assert not known.editable.eval(*pairs())[:, 2].any()
    assert not known.editable.curves["diffuse"].values[:, 2].any()


def cook_torrance(wi: Floats, wo: Floats) -> Floats:
    model = model_named("cook-torrance")(m=0.2, n=(0.2, 1.1, 1.5), k=(3.0, 2.0, 1.0))
    return np.asarray(model.eval(wi, wo))


@pytest.mark.long
def test_factors_of_cook_torrance_are_its_distribution_and_its_fresnel_factor() -> None:
    result = factorise(table_of(cook_torrance))
    sound(result)
    assert [term.name for term in result.editable.terms] == ["specular"]
    h, d = np.arange(1.0, 22), np.arange(2.0, 75)
    beckmann = np.exp(-((np.tan(h * DEG) / 0.2) ** 2)) / np.cos(h * DEG) ** 4
    fresnel = conductor(np.cos(d * DEG)[:, None], np.array((0.2, 1.1, 1.5)), np.array((3.0, 2.0, 1.0)))
    for channel in range(3):
        assert up_to_scale(found(result.editable, "highlight", h, channel), beckmann) < 0.03
        assert up_to_scale(found(result.editable, "fresnel", d, channel), fresnel[:, channel]) < 0.03
    assert result.errors["l1"] < 0.01


MATERIALS = {
    "plastic": Material(kd=(0.4, 0.2, 0.1), lobes=(Lobe(mx=0.15, my=0.15, r0=0.05, k=0.8),)),
    "metal": Material(lobes=(Lobe(mx=0.2, my=0.2, r0=(0.9, 0.7, 0.4), alpha=0.3),)),
    "matte": Material(kd=(0.5, 0.4, 0.3)),
}


@pytest.mark.parametrize("name", MATERIALS)
@pytest.mark.usefixtures("coarse")
def test_the_diffuse_term_is_there_where_the_material_has_one(name: str) -> None:
    material = MATERIALS[name]
    result = factorise(table_of(MaterialBSDF(material).eval))
    sound(result)
    terms = [term.name for term in result.editable.terms]
    assert terms == {"plastic": ["diffuse", "specular"], "metal": ["specular"], "matte": ["diffuse"]}[name]
    if any(material.kd):
        x = np.arange(2.0, 60)
        level = [
            found(result.editable, "diffuse", x, c) * found(result.editable, "diffuse viewer", x, c) for c in range(3)
        ]
        assert np.allclose(level, np.array(material.kd)[:, None] / np.pi, rtol=0.05)
    assert result.errors["cuberoot"] < 0.01


@pytest.mark.usefixtures("coarse")
def test_unedited_curves_are_the_table_at_the_nodes_of_the_remainder() -> None:
    """A table that no product is: the nodes of the grid take its values, within the bound of the ratio."""

    def shape(wi: Floats, wo: Floats) -> Floats:
        a = angles_of(wi, wo)
        return np.stack([0.1 + 0.05 * np.cos(3 * (a["theta_i"] + a["theta_o"])) * wi[..., 2] * wo[..., 2]] * 3, axis=-1)

    result = factorise(table_of(shape))
    sound(result)
    grid = result.editable.terms[0].quotient.grid  # type: ignore[attr-defined]
    wi, wo = (w.reshape(-1, 3)[::7] for w in grid.directions())
    above = (wi[:, 2] > 0.03) & (wo[:, 2] > 0.03)
    expected = shape(wi, wo)[above]
    assert np.allclose(result.editable.eval(wi, wo)[above], expected, rtol=1e-5)
    assert result.errors["l1"] < 0.02 < 0.03 < result.without_quotient["l1"]  # interpolation in the coarse grid


@pytest.mark.usefixtures("coarse")
def test_noise_does_not_roughen_the_curves() -> None:
    noise = np.random.default_rng(3)

    def noisy(wi: Floats, wo: Floats) -> Floats:
        f = diffuse_and_highlight(wi, wo)
        return np.asarray(f * (1 + 0.1 * noise.standard_normal(f.shape)) + 1e-3 * noise.standard_normal(f.shape))

    result = factorise(table_of(noisy))
    sound(result)
    x = np.arange(1.0, 18)
    assert up_to_scale(found(result.editable, "highlight", x), np.exp(-((x * DEG / 0.2) ** 2))) < 0.08
    x = np.arange(2.0, 65)
    assert up_to_scale(found(result.editable, "diffuse", x), np.cos(x * DEG) ** 0.5) < 0.06


@pytest.mark.usefixtures("coarse")
def test_black_and_broken_tables_make_no_nan() -> None:
    def holes(wi: Floats, wo: Floats) -> Floats:
        f = diffuse_and_highlight(wi, wo)
        return np.where(wi[..., :1] > 0.9, np.nan, f)

    sound(
        factorise(
            FormulaTable(
                holes, channels=3, isotropic=True, pairs=(direction(0.2, np.pi)[None], direction(0.3, 0)[None])
            )
        )
    )
    black = factorise(table_of(lambda wi, wo: np.zeros((*wi.shape[:-1], 1)), channels=1))
    assert not black.editable.eval(*pairs()).any()


@pytest.mark.long
@pytest.mark.usefixtures("coarse")
def test_brushed_tables_keep_their_azimuth_in_the_remainder() -> None:
    material = Material(kd=0.1, lobes=(Lobe(mx=0.2, my=0.4, r0=0.5, k=0.6),))
    bsdf = MaterialBSDF(material)
    result = factorise(table_of(bsdf.eval, isotropic=False))
    assert result.errors["l1"] < 0.05 < result.without_quotient["l1"]


@pytest.mark.usefixtures("coarse")
def test_both_sides_of_a_sheet_are_factored() -> None:
    material = Material(kd=0.2, kt_d=0.1, lobes=(Lobe(mx=0.3, my=0.3, r0=0.1, k=0.8, side="transmission"),))
    bsdf = MaterialBSDF(material)
    table: MeasuredTable = table_of(bsdf.eval, transmits=True)
    result = factorise(table)
    wi, wo = pairs()
    for flip in (np.ones(3), FLIP_Z):
        expected, got = bsdf.eval(wi, wo * flip), result.editable.eval(wi, wo * flip)
        assert np.abs(got - expected).mean() < 0.02 * expected.mean()
    assert {term.side for term in result.editable.terms} == {"reflection", "transmission"}
