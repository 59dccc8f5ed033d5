"""Terms and curves are the model, document or table that they were made of: angles, curves, albedos, errors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.core.geometry.sequences import r2
from lambent.materials.bsdf import MaterialBSDF, components
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.albedo import albedo, term_albedo
from lambent.materials.factored.curve import END_RAD, KNOTS, Curve, angles_rad
from lambent.materials.factored.of_lobes import lobe_terms, of_material
from lambent.materials.factored.of_models import editable, same_quotients
from lambent.materials.factored.opening import editable_of
from lambent.materials.factored.parametrisations import PARAMETRISATIONS, angle_of
from lambent.materials.factored.quotients import CoupledDiffuse, Microfacets, One
from lambent.materials.factored.tabulated import Grid
from lambent.materials.factored.terms import Factor, Term, narrowed, thinned
from lambent.materials.fitting import factors
from lambent.materials.lobes import NUMPY
from lambent.materials.measured.merl import SCALES, MerlTable, bin_centres, directions_of
from lambent.materials.models import model_named, models
from lambent.materials.models.model import Model
from tests.materials.export.formula_table import pairs_near_the_mirror


def test_a_diffuse_surface_has_its_colour() -> None:
    material = Material(kd=(0.5, 0.3, 0.2), kt_d=(0.1, 0.2, 0.3))
    assert albedo(of_material(material), "reflection") == pytest.approx([0.5, 0.3, 0.2], abs=1e-12)
    assert albedo(of_material(material), "transmission") == pytest.approx([0.1, 0.2, 0.3], abs=1e-12)


def test_a_blinn_lobe_of_exponent_0() -> None:
    """(e + 2) / 2 pi cos^e G / (4 cos cos), white: .5524 +- .0002 by Monte Carlo; Ben-Artzi 2007 has .56."""
    lobe = editable(model_named("cook-torrance")())
    constant = {name: Curve.constant() for name in lobe.curves}
    found = term_albedo(replace(lobe.terms[0], scale=(1 / np.pi,) * 3), constant)
    assert found == pytest.approx([0.5524] * 3, abs=1e-3)


@pytest.mark.long
@pytest.mark.parametrize(
    "lobe", [Lobe(mx=0.1, my=0.1, r0=0.5), Lobe(mx=0.1, my=0.3, r0=0.5), Lobe(mx=0.005, my=0.005, r0=0.9)], ids=str
)
def test_lobes_by_importance_sampling(lobe: Lobe) -> None:
    """The mean over cosine distributed viewers of what the lobe's own sampling finds."""
    u = r2(256)
    cosine, phi = np.sqrt(1 - u[:, 0]), 2 * np.pi * u[:, 1]
    wo = np.stack([np.sqrt(u[:, 0]) * np.cos(phi), np.sqrt(u[:, 0]) * np.sin(phi), cosine], axis=1)
    material = Material(kd=0.0, lobes=(lobe,))
    expected = MaterialBSDF(material).albedo(wo, 4096).mean(axis=0)
    assert albedo(of_material(material), "reflection") == pytest.approx(expected, rel=0.01)


def test_band_means_are_integrals() -> None:
    bands = 128
    edges = np.linspace(0, END_RAD, bands + 1)
    means = Curve.of(np.cos).band_means(bands)
    exact = (np.sin(edges[1:]) - np.sin(edges[:-1])) / (edges[1] - edges[0])
    assert np.allclose(means, exact[:, None], rtol=1e-6)


def test_channels_and_constant_ends() -> None:
    curve = Curve.through(np.array([0.2, 0.4]), np.array([[1, 2, 3], [3, 2, 1.0]]))
    assert np.allclose(curve.at(np.array([0.0, 0.3, 1.0])), [[1, 2, 3], [2, 2, 2], [3, 2, 1]], atol=1e-3)
    assert np.array_equal(curve.at(np.array([1.6])), [[0, 0, 0]])


def test_values_are_checked_and_read_only() -> None:
    with pytest.raises(ValueError, match="finite RGB"):
        Curve(np.zeros((7, 3)))
    with pytest.raises(ValueError, match="finite RGB"):
        Curve.constant(np.nan)
    with pytest.raises(ValueError, match="do not divide"):
        Curve.constant().band_means(100)
    with pytest.raises(ValueError, match="read-only"):
        Curve.constant().values[0] = 2
    assert len(angles_rad()) == KNOTS + 1


@pytest.mark.parametrize(("nodes", "polar"), [(16, 2), (128, 1)])
@pytest.mark.parametrize("width", [0.003, 0.02, 0.05, 0.1, 0.4])
def test_peaks_about_an_axis_keep_their_light(nodes: int, polar: int, width: float) -> None:
    """To 3 %, however narrow; with means over bands, the narrowest is 31 times as bright."""
    curve = Curve.of(lambda x: np.exp(-((np.tan(np.minimum(x, 1.5)) / width) ** 2)))
    at = (np.arange(nodes) + 0.5) * END_RAD / nodes
    rings = np.sin(polar * angles_rad())
    light, expected = (rings @ c.values for c in (Curve.through(at, curve.node_values(nodes, polar)), curve))
    assert np.allclose(light, expected, rtol=0.03)
    assert (curve.node_values(nodes, polar) >= 0).all()
    level = Curve.constant(0.7)
    assert np.allclose(level.node_values(nodes, polar), 0.7) and np.allclose(level.band_means(nodes, polar), 0.7)


def test_node_values_keep_the_sum_and_never_overshoot() -> None:
    """Of steps and of peaks narrower than a band, too, wherever these are."""
    rng = np.random.default_rng(0)
    for curve in (
        Curve.of(lambda x: (x > 0.7).astype(float)),
        Curve.of(lambda x: np.exp(-(((x - 0.5) / 0.004) ** 2))),
        Curve(rng.random((KNOTS + 1, 3))),
    ):
        for nodes in (1, 2, 16, 128, KNOTS):
            values = curve.node_values(nodes)
            assert np.allclose(values.sum(axis=0), curve.band_means(nodes).sum(axis=0))
            assert (values >= curve.values.min(axis=0) - 1e-12).all()
            assert (values <= curve.values.max(axis=0) + 1e-12).all()


KURT = Material(name="silk", kd=0.2, lobes=(Lobe(mx=0.1, my=0.3, r0=0.1, k=0.5, alpha=0.2),))
SHEET = Material(kd=0.2, kt_d=0.1, lobes=(Lobe(mx=0.3, my=0.3, r0=0.1, k=0.8, side="transmission"),))


@pytest.mark.parametrize("subject", [KURT, SHEET, model_named("cook-torrance")(m=0.2), model_named("lambert")()])
def test_documents_and_models_have_curves_of_their_own(subject: Material | Model) -> None:
    opened = editable_of(subject)
    assert opened.editable.curves
    assert 0 <= max(opened.errors.values()) < 1e-4
    assert not opened.without_quotient


def test_a_document_s_path_opens_as_its_curves(tmp_path: Path) -> None:
    KURT.save(tmp_path / "silk.json")
    opened = editable_of(tmp_path / "silk.json")
    assert set(opened.editable.curves) == {"diffuse", "highlight along", "highlight across"}


@pytest.mark.long
def test_a_merl_file_s_own_bins_are_exact(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A small table of MERL's layout that no product is."""
    monkeypatch.setattr(factors, "FITTED", Grid(45, 24, 12, turns_d=2))
    shape = (20, 12, 16)
    theta_h, theta_d, phi_d = np.broadcast_arrays(*bin_centres(shape))
    wi, wo = directions_of(theta_h, theta_d, phi_d)
    f = 0.05 + 2 * np.exp(-((theta_h / 0.3) ** 2)) * (0.1 + theta_d**2) * (1 + 0.3 * np.cos(2 * phi_d))
    f = np.where((wi[..., 2] > 0) & (wo[..., 2] > 0), f, -1.0)
    planes = f / SCALES[:, None, None, None]
    (tmp_path / "small.binary").write_bytes(np.array(shape, "<i4").tobytes() + planes.astype("<f8").tobytes())
    opened = editable_of(tmp_path / "small.binary")
    assert opened.errors["l1"] < 1e-5 < 0.01 < opened.without_quotient["l1"]
    table = MerlTable(planes, tmp_path / "small.binary")
    chosen = np.random.default_rng(0).permutation(wi[..., 0].size)[:500]
    i, o = (w.reshape(-1, 3)[chosen] for w in (wi, wo))
    steep = (i[:, 2] > 0.1) & (o[:, 2] > 0.1)
    assert np.allclose(opened.editable.eval(i[steep], o[steep]), table.eval(i[steep], o[steep]), rtol=1e-4)


def test_files_of_no_kind_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be read"):
        editable_of(tmp_path / "missing.bsdf")
    (tmp_path / "broken.json").write_text('{"kd": ')
    with pytest.raises(UserError, match="JSON cannot be read"):
        editable_of(tmp_path / "broken.json")
    (tmp_path / "notes.txt").write_text("some notes\n")
    with pytest.raises(UserError, match="unknown format of measured material"):
        editable_of(tmp_path / "notes.txt")


class Unknown(Model):
    name, title, source, parameters = "unknown", "Unknown", "", ()

    def eval(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return np.zeros(wi.shape)

    def pdf(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return np.zeros(wi.shape[:-1])

    def sample(self, wo: np.ndarray, u: np.ndarray) -> np.ndarray:
        return wo


def test_a_model_without_curves_says_so() -> None:
    with pytest.raises(UserError, match="no curves to edit"):
        editable_of(Unknown())


DEG = np.pi / 180


def angle(name: str, wi: tuple[float, float], wo: tuple[float, float], stretch: float = 1.0) -> float:
    wi_, wo_ = (components(direction(theta * DEG, phi * DEG)) for theta, phi in (wi, wo))
    return float(angle_of(name, wi_, wo_, stretch) / DEG)


@pytest.mark.parametrize(
    ("name", "wi", "wo", "expected"),
    [
        ("theta_i", (25, 70), (50, 0), 25), ("theta_o", (25, 70), (50, 0), 50),
        ("theta_h", (30, 0), (50, 0), 40), ("theta_h", (30, 180), (50, 0), 10),
        ("theta_d", (30, 0), (50, 0), 10), ("theta_d", (30, 180), (50, 0), 40),
        ("theta_r", (30, 180), (50, 0), 20), ("theta_r", (30, 0), (50, 0), 80), ("theta_r", (80, 0), (80, 0), 160),
        ("slope_t", (30, 0), (50, 0), 40), ("slope_b", (30, 0), (50, 0), 0),
        ("slope_b", (30, 90), (50, 90), 40), ("gamma_t", (30, 0), (50, 0), 40), ("gamma_b", (30, 0), (50, 0), 0),
        ("gamma_t", (30, 45), (50, 45), np.degrees(np.arccos(np.sqrt(np.cos(40 * DEG))))),
    ],
)  # fmt: skip
def test_known_angles(name: str, wi: tuple[float, float], wo: tuple[float, float], expected: float) -> None:
    assert angle(name, wi, wo) == pytest.approx(expected, abs=1e-9)


def test_stretch_makes_circles_of_ellipses() -> None:
    """Half vectors on the ellipse tan = mx along t, my along b have one stretched theta_h."""
    mx, my = 0.1, 0.4
    along = direction(np.arctan(mx), 0.0)
    across = direction(np.arctan(my), np.pi / 2)
    found = [angle_of("theta_h", components(h), components(h), np.sqrt(my / mx)) for h in (along, across)]
    assert found[0] == pytest.approx(found[1])
    assert np.tan(found[0]) == pytest.approx(np.sqrt(mx * my))


@pytest.mark.parametrize("name", PARAMETRISATIONS)
def test_float32_is_precise_at_every_scale(name: str) -> None:
    """Half vectors and mirror directions off by 1e-5 to 1 rad: within 1e-6 rad of float64."""
    rng = np.random.default_rng(2)
    wo = direction(rng.uniform(0, 1.4, 20_000), rng.uniform(0, 2 * np.pi, 20_000))
    wi = wo * [-1, -1, 1] + rng.normal(size=(20_000, 3)) * 10 ** rng.uniform(-5, 0, (20_000, 1))
    wi[:, 2] = np.abs(wi[:, 2])
    wi = (wi / np.linalg.norm(wi, axis=1, keepdims=True)).astype(np.float32)
    wo = wo.astype(np.float32)
    single = [tuple(w[:, c] for c in range(3)) for w in (wi, wo)]
    double = [tuple(w[:, c].astype(float) for c in range(3)) for w in (wi, wo)]
    exact = angle_of(name, *double)
    assert np.abs(angle_of(name, *single) - exact).max() < 1e-6
    assert exact.min() >= 0
    assert exact.max() <= (np.pi if name == "theta_r" else np.pi / 2) + 1e-12


VALUES = {
    "phong": [{"exponent": 30}, {"exponent": 500}],
    "ashikhmin-shirley": [{"ex": 20, "ey": 20}, {"ex": 8, "ey": 300, "rs": (0.1, 0.4, 0.8)}],
    "cook-torrance": [{"m": 0.1}, {"m": 0.3, "n": (0.2, 1.1, 1.5), "k": (3, 2, 1)}],
    "ward": [{}, {"mx": 0.08, "my": 0.3}],
    "ward-original": [{}, {"mx": 0.08, "my": 0.3}],
    "kurt": [{"alpha": 0.4}, {"mx": 0.08, "my": 0.3, "r0": (0.02, 0.3, 0.9)}],
    "kurt-ggx": [{"alpha": 0.4}, {"mx": 0.08, "my": 0.3}],
    "kurt-transmission": [{"r0": 0.3}, {"mx": 0.08, "my": 0.3, "r0": 0.3}],
    "ggx": [{}, {"alpha_x": 0.1, "alpha_y": 0.4}],
    "schlick": [{}, {"p": 0.3, "r": 0.2}],
    "oren-nayar": [{"sigma": 0}, {"sigma": 30}],
}


def pairs(across: bool = False) -> tuple[np.ndarray, np.ndarray]:
    wi, wo = pairs_near_the_mirror(lowest=0.03, spread=0.1)
    return wi * (1, 1, -1 if across else 1), wo


@pytest.mark.parametrize("name", models())
def test_terms_are_the_model(name: str) -> None:
    wi, wo = pairs(across=name == "kurt-transmission")
    for values in VALUES.get(name, [{}]):
        model = model_named(name)(**values)
        expected, found = model.eval(wi, wo), editable(model).eval(wi, wo)
        assert expected.any()
        assert np.allclose(found, expected, rtol=3e-3, atol=3e-4 * expected.max()), values
        assert not editable(model).eval(wi * [1, 1, -1], wo).any()


def test_documents_are_the_sum_of_their_parts() -> None:
    lobes = (
        Lobe(k=(0.5, 0.4, 0.3), mx=0.1, my=0.1, r0=0.04, alpha=0.3),
        Lobe(k=0.3, mx=0.2, my=0.4, r0=(0.1, 0.2, 0.3), distribution="ggx"),
        Lobe(k=0.6, mx=0.1, my=0.3, r0=0.2, side="transmission"),
    )
    for coupled in (False, True):
        material = Material(kd=(0.3, 0.2, 0.1), kd_coupled=coupled, kt_d=(0.1, 0.2, 0.3), lobes=lobes)
        for across in (False, True):
            wi, wo = pairs(across)
            expected = MaterialBSDF(material).eval(wi, wo)
            assert np.allclose(of_material(material).eval(wi, wo), expected, rtol=3e-3, atol=3e-4 * expected.max())


@pytest.mark.parametrize(("mx", "my"), [(0.1, 0.1), (0.08, 0.2)])
def test_wider_slopes_are_looked_up_in_the_same_curves(mx: float, my: float) -> None:
    """With slopes 1.7 times as wide, the terms are the lobe of those slopes."""
    lobe, wider = (Lobe(mx=r * mx, my=r * my, r0=1.0, alpha=0.3) for r in (1.0, 1.7))
    (term, *_), curves = lobe_terms(lobe)
    wi, wo = pairs()
    pair = components(wi), components(wo)
    found = np.asarray(term.scale) * (term.quotient.evaluate(*pair, NUMPY) * thinned(term, *pair, 1.7, NUMPY))[:, None]
    for factor in term.factors:
        found = found * curves[factor.curve].at(narrowed(factor.over, angle_of(factor.over, *pair), 1.7, NUMPY))
    expected = MaterialBSDF(Material(lobes=(wider,))).eval(wi, wo)
    assert np.allclose(found, expected, rtol=3e-3, atol=3e-4 * expected.max())


def test_colours_and_curves_change_no_quotient() -> None:
    """What a slider may change while the transport stays, and what it may not."""
    kurt = model_named("kurt")
    start = editable(kurt(mx=0.1, my=0.1))
    assert same_quotients(start, editable(kurt(mx=0.3, my=0.3, k=0.2, r0=0.9)))
    assert not same_quotients(start, editable(kurt(mx=0.1, my=0.1, alpha=0.5)))
    assert not same_quotients(start, editable(kurt(mx=0.1, my=0.3)))


DIFFUSE_TERMS = {
    "ashikhmin-shirley": {"diffuse"},
    "lambert": {"diffuse"},
    "oren-nayar": {"diffuse", "towards the light", "aside", "twice"},
}


@pytest.mark.parametrize(
    "name", ["lambert", "oren-nayar", "ashikhmin-shirley", "phong", "ward", "ggx", "cook-torrance"]
)
def test_terms_of_models(name: str) -> None:
    found = {term.name for term in editable(model_named(name)()).terms if term.is_diffuse}
    assert found == DIFFUSE_TERMS.get(name, set())


def test_terms_of_a_document() -> None:
    lobe, brushed = Lobe(k=(0.2,) * 3, mx=0.1, my=0.1), Lobe(k=(0.2,) * 3, mx=0.1, my=0.3)
    terms = of_material(Material(name="m", kd=(0.5,) * 3, kt_d=(0.1,) * 3, lobes=(lobe, brushed))).terms
    assert {term.name for term in terms if term.is_diffuse} == {"diffuse", "diffuse through"}


@pytest.mark.parametrize("viewer", [None, "seen"])
def test_the_quotient_decides_for_a_term_without_factors(viewer: str | None) -> None:
    """A constant is Lambertian, so that the diffuse texture multiplies it; the quotient of a lobe is a highlight."""
    for quotient, diffuse in ((One(), True), (CoupledDiffuse(), True), (Microfacets(), False)):
        assert Term("scale", quotient, (0.3, 0.2, 0.1), viewer=viewer).is_diffuse == diffuse


def test_one_curve_over_the_half_angle_makes_a_highlight() -> None:
    factors = (Factor("light", "theta_i"), Factor("shine", "theta_h"))
    assert not Term("t", One(), factors=factors).is_diffuse
    assert Term("t", One(), factors=factors[:1]).is_diffuse
