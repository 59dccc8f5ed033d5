"""Faults of tables made with them are reported with their numbers; sound tables have none. Metrics by hand."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction, normalize
from lambent.materials.bsdf import ENERGY_TOLERANCE, MaterialBSDF
from lambent.materials.checking.check_table import _warnings, albedos
from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.account import _energy
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.inspection import inspect_table, too_bright
from lambent.materials.measured.inspecting.metrics import METRICS, metric_named
from lambent.materials.measured.inspecting.synthetic import ISOTROPIC, record, synthesise
from lambent.materials.measured.protocol import LeftOut, MeasuredSamples, TableInfo
from lambent.materials.models import model_named
from tests.materials.export.formula_table import FormulaTable
from tests.materials.measured.measured_files import GLOSSY


@pytest.mark.long
def test_every_format_and_json(files: dict[str, Path]) -> None:
    for path in files.values():
        report = inspect_table(load(path))
        assert json.loads(json.dumps(report)) == report
        assert report["format"] == load(path).info.format and report["tuples"]["used"] > 0


def test_real_files(shared_data: Path) -> None:
    faults = inspect_table(load(shared_data / "measured" / "rgl" / "cc_ibiza_sunset_rgb.bsdf"))["faults"]
    assert 3 < faults["non_reciprocal_percent"] < 25 and faults["negative_percent"] > 1


@pytest.mark.parametrize(("excess", "warned"), [(8e-10, False), (0.9, False), (1.1, True)])
def test_only_more_than_the_tolerance_is_more_than_arrives(excess: float, warned: bool) -> None:
    """`excess` over 1 in units of the tolerance, but for the first, which is rounding."""
    albedo = 1 + (excess if excess < 1e-6 else excess * ENERGY_TOLERANCE)

    wi, wo = (direction(np.linspace(0, 1.2, 40), phi) for phi in (0.0, np.pi))
    white = FormulaTable(lambda i, o: np.full((*i.shape[:-1], 1), albedo / np.pi), isotropic=True, pairs=(wi, wo))
    white.reflectivity = lambda wi: np.full((*wi.shape[:-1], 1), albedo)
    report = inspect_table(white)
    assert report["faults"]["energy_above_one"] is warned
    assert any("more than arrives" in line for line in report["findings"]) is warned
    furnace = albedos(white)
    assert any("more than arrives" in line or "measured well" in line for line in _warnings(0.0, furnace)) is warned
    document = Material(kd=albedo)
    assert any("more light than it receives" in line for line in _energy(document)) is warned


INFO = TableInfo("by hand", "test", False, False, 1, "f")


def two_tuples() -> MeasuredSamples:
    """wi at 60 and 0 degrees, wo at 30 and 60 degrees; f 2 and 0.5; weights sin(theta_o)."""
    theta_i, theta_o = np.radians([60.0, 0.0]), np.radians([30.0, 60.0])
    f = np.array([[2.0], [0.5]])
    return MeasuredSamples(direction(theta_i, 0.0), direction(theta_o, 1.0), f, np.sin(theta_o), LeftOut(), INFO)


MODEL = np.array([[1.0], [1.5]])
SIN_O, COS_O, COS_I = (0.5, 0.8660254), (0.8660254, 0.5), (0.5, 1.0)


def mean(values, power=1.0):
    return (sum(weight * value for weight, value in zip(SIN_O, values, strict=True)) / sum(SIN_O)) ** power


ROOTS = [(c * f + 1e-5) ** (1 / 3) for c, f in zip(COS_I * 2, (2.0, 0.5, 1.0, 1.5), strict=True)]
BY_HAND = {
    "l1": mean((COS_I[0] * COS_O[0], COS_I[1] * COS_O[1])),  # equation 3.7
    "l2_ngan": mean((COS_I[0] ** 2, COS_I[1] ** 2), 0.5),
    "cuberoot": mean(((ROOTS[0] - ROOTS[2]) ** 2, (ROOTS[1] - ROOTS[3]) ** 2), 0.5),
    "log": mean((np.log(2.0 / 1.5) ** 2, np.log(1.5 / 2.5) ** 2), 0.5),
}


@pytest.mark.parametrize("name", METRICS)
def test_errors_by_hand(name):
    assert METRICS[name].error(two_tuples(), MODEL) == pytest.approx(BY_HAND[name], rel=1e-6)


@pytest.mark.parametrize("name", METRICS)
def test_slope_is_the_derivative_of_the_transform(name):
    x, step = np.array([1e-3, 0.1, 3.0]), 1e-7
    metric = METRICS[name]
    numeric = (metric.transform(x + step) - metric.transform(x - step)) / (2 * step)
    np.testing.assert_allclose(metric.slope(x), numeric, rtol=1e-5)


def test_unknown_metric_names_the_nearest():
    with pytest.raises(UserError, match="did you mean 'cuberoot'"):
        metric_named("cuberot")


CLEAN = replace(
    ISOTROPIC, noise=0.0, floor=0.0, theta_i_deg=tuple(range(0, 80, 10)), sector_deg=0.0, step_deg=5, fine_deg=2.5
)
Evaluate = Callable[[np.ndarray, np.ndarray], np.ndarray]


def findings(evaluate: Evaluate, **changes: object) -> list[str]:
    return inspect_table(record(evaluate, "made up", replace(CLEAN, **changes)))["findings"]


def bump_towards_light(height: float, width_deg: float) -> Evaluate:
    def retro(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        apart = np.degrees(np.arccos(np.sum(wi * wo, axis=1).clip(-1, 1)))
        return (0.1 + 0.1 * height * np.exp(-((apart / width_deg) ** 2)))[:, None]

    return retro


def test_a_sound_table_has_no_findings() -> None:
    assert inspect_table(synthesise(GLOSSY, CLEAN))["findings"] == []


@pytest.mark.parametrize("sector_deg", [0.0, 4.0])
def test_a_retro_reflector_is_named_though_the_lamp_hides_the_peak(sector_deg: float) -> None:
    found = findings(bump_towards_light(3, 10), sector_deg=sector_deg)
    line = next(line for line in found if "retro-reflective" in line)
    assert "between incident directions" in line
    ratio = float(line.split("towards the light is ")[1].split(" times")[0])
    assert 2 < ratio < 4.2


def oren_nayar(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """Brighter on the light's side, but without a peak."""
    return model_named("oren-nayar")(rho=0.2, sigma=40).eval(wi, wo)


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_other_peaks_are_not_retro_reflective(noise: float) -> None:
    for evaluate in (oren_nayar, bump_towards_light(0.2, 10), lambda wi, wo: 0.1 + 0 * wi[:, :1]):
        assert not any("retro" in line for line in findings(evaluate, noise=noise))
    mirrorlike = Material(name="m", lobes=(Lobe(mx=0.15, my=0.15, r0=(0.9,) * 3, k=(1.0,) * 3),))
    assert not any(
        "retro" in line for line in inspect_table(synthesise(mirrorlike, replace(CLEAN, noise=noise)))["findings"]
    )


def test_more_light_than_arrives_is_reported_with_its_angle() -> None:
    found = findings(lambda wi, wo: (0.25 / wi[:, 2:]) * np.ones(1))
    line = next(line for line in found if "more than arrives" in line)
    assert "at theta_i = 75 degrees" in line and "over 1 at 45, 60, 75 degrees" in line
    value = float(line.split("returns ")[1].split(" of")[0])
    assert value == pytest.approx(0.25 / np.cos(np.radians(70)) * np.pi, rel=0.1)  # 75 takes the grid's edge, 70


def test_an_asymmetric_table_is_reported() -> None:
    found = findings(lambda wi, wo: 0.1 + 0.05 * wo[:, 1:2])
    assert any("taken as isotropic, but mirrored directions differ by" in line for line in found)
    quadrant = findings(lambda wi, wo: 0.1 + 0.05 * wo[:, 1:2], symmetry="quadrant", phi_i_deg=(0.0, 45.0, 90.0))
    assert any("taken as quadrant" in line for line in quadrant)


def test_non_reciprocal_and_left_out() -> None:
    setup = replace(CLEAN, sector_deg=10.0, floor=0.05)
    report = inspect_table(record(lambda wi, wo: (0.02 + wi[:, 2:]) * np.ones(1) * 0.1, "made up", setup))
    found, percent = report["findings"], report["faults"]
    assert percent["not_measured_percent"] > 0 == percent["not_finite_percent"] < percent["negative_percent"]
    assert any("swapping light and viewer" in line for line in found)
    assert any("not measured" in line for line in found) and any("are below zero: f in" in line for line in found)


def test_a_lobe_narrower_than_the_grid() -> None:
    narrow = Material(name="m", kd=(0.1,) * 3, lobes=(Lobe(mx=0.012, my=0.012, r0=(0.9,) * 3, k=(1.0,) * 3),))
    found = inspect_table(synthesise(narrow, replace(CLEAN, fine_deg=5)))["findings"]
    line = next(line for line in found if "under-sampled" in line)
    assert "within one step of" in line
    fine = inspect_table(synthesise(narrow, replace(CLEAN, fine_deg=0.25, fine_reach_deg=2)))["findings"]
    assert not any("under-sampled" in line for line in fine)


def test_half_vector_and_quadrilinear_between_two_incident_directions() -> None:
    """Figures 3.1 and 3.2 of the thesis, at 45 degrees with measurements at 40 and 50.

    Aligned on the half vector, the lobe stands at its place and keeps its height; blended as it stands, it falls to two
    lower lobes where it was measured.
    """
    lobe = Material(name="lobe", lobes=(Lobe(mx=0.04, my=0.04, r0=(1.0,) * 3, k=(1.0,) * 3, alpha=0.5),))
    setup = replace(CLEAN, theta_i_deg=(40, 50), step_deg=1, fine_deg=0.5)
    theta = np.linspace(30, 60, 601)
    wi = np.broadcast_to(direction(np.radians(45), 0.0), (len(theta), 3))
    ahead, table = direction(np.radians(theta), np.pi), synthesise(lobe, setup)
    ways = (replace(table, reconstruction=way) for way in ("half_vector", "quadrilinear"))
    aligned, blended, truth = (one.eval(wi, ahead).mean(axis=1) * ahead[:, 2] for one in (*ways, MaterialBSDF(lobe)))
    assert theta[aligned.argmax()] == pytest.approx(theta[truth.argmax()], abs=0.3)
    assert aligned.max() == pytest.approx(truth.max(), rel=0.03)
    assert peaks_of(aligned) == 1 and peaks_of(blended) == 2
    assert blended[np.abs(theta - 45).argmin()] < 0.4 * truth.max()
    assert np.abs(aligned - truth).sum() < 0.05 * truth.sum() < np.abs(blended - truth).sum() / 10


def peaks_of(curve: np.ndarray) -> int:
    """Local maxima above a fifth of the highest."""
    inner = curve[1:-1]
    return int(((inner > curve[:-2]) & (inner >= curve[2:]) & (inner > curve.max() / 5)).sum())


def test_one_channel_that_returns_more_than_arrives_is_said() -> None:
    (said,) = too_bright(np.array([10.0, 20.0, 30.0]), np.array([[0.5, 0.5, 0.5], [0.5, 1.2, 0.5], [1.1, 0.5, 0.5]]))
    assert "1.2 of the light (green) at theta_i = 20 degrees" in said and "over 1 at 20, 30 degrees" in said


def glossy(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    half = normalize(wi + wo)
    return (0.1 + 2 * np.exp(-((np.tan(np.arccos(half[:, 2].clip(1e-3, 1))) / 0.3) ** 2)))[:, None]


def test_a_saturated_peak_is_reported() -> None:
    """A device that stops at 1.2 /sr cuts a peak of 2.1; the peak itself, an even and a black table are sound."""
    found = [line for line in findings(lambda wi, wo: glossy(wi, wo).clip(0, 1.2)) if "saturated" in line]
    assert len(found) == 1 and "1.2 /sr" in found[0]
    for sound in (glossy, lambda wi, wo: np.full((len(wi), 1), 0.1), lambda wi, wo: np.zeros((len(wi), 1))):
        assert not any("saturated" in line for line in findings(sound))


def test_one_angle_of_incidence_is_said() -> None:
    said = "one angle of incidence, 30 degrees"
    assert any(said in line for line in findings(glossy, theta_i_deg=(30,)))
    assert not any("one angle of incidence" in line for line in findings(glossy))
