"""Gonio tables: round trip, quantities, symmetries and turns, readings below zero; scattered tables between tuples."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction, normalize
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.inspection import extrapolation, inspect_table
from lambent.materials.measured.inspecting.synthetic import ANISOTROPIC, ISOTROPIC, synthesise
from lambent.materials.measured.lbnl_xml import read as read_xml
from lambent.materials.measured.parts.gonio_text import write_gonio
from lambent.materials.measured.parts.spectral import rgb_of_measured, rgb_of_xyz
from lambent.materials.measured.protocol import MeasuredSamples, TableInfo, collect, negative_readings
from lambent.materials.measured.tables.gonio import AnySheet, GonioTable
from lambent.materials.measured.tables.scattered import NEIGHBOURS, ScatteredTable, _place
from lambent.materials.measured.tables.sheets import ScatteredSheet, Sheet
from lambent.materials.measured.tables.table import MARKS, isotropic_brdf
from tests.materials.measured.lbnl_files import lbnl_xml, words
from tests.materials.measured.measured_files import (
    GLOSSY,
    Loaded,
    cornell_rows,
    cornell_text,
    fred_text,
    merl_bytes,
    zemax_text,
)

SHARP = Lobe(k=(0.5,) * 3, mx=0.06, my=0.06, r0=(0.05,) * 3, distribution="ggx")
ROUGH = SHARP.model_copy(update={"mx": 0.3, "my": 0.3})
MATERIALS = {
    "flat": Material(kd=(0.5, 0.3, 0.1)),
    "rough": Material(kd=(0.3, 0.2, 0.1), lobes=(ROUGH,)),
    "sharp": Material(kd=(0.3, 0.2, 0.1), lobes=(SHARP,)),
    "metal": Material(kd=0.0, lobes=(ROUGH.model_copy(update={"r0": (0.9,) * 3, "mx": 0.2, "my": 0.2}),)),
    "brushed": Material(kd=0.2, lobes=(ROUGH.model_copy(update={"mx": 0.1}),)),
}


def retro(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    apart = np.arccos(np.sum(wi * wo, axis=-1).clip(-1, 1))
    return (0.1 + 3 * np.exp(-((apart / 0.15) ** 2)))[..., None] * np.ones(3)


TRUTHS = {**{name: MaterialBSDF(material).eval for name, material in MATERIALS.items()}, "retro": retro}


def scan(hemisphere, about_light_deg: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Five incident directions, with viewers all over and closer about the mirror direction, none about the light."""
    random, wi, wo = np.random.default_rng(0), [], []
    for theta in np.radians((10, 30, 45, 60, 75)):
        light = direction(theta, 0.0)
        near = normalize(light * (-1, -1, 1) + random.normal(0, 0.15, (120, 3)))
        seen = np.concatenate([hemisphere(120, int(100 * theta)), near[near[:, 2] > 0.15]])
        seen = seen[seen @ light < np.cos(np.radians(about_light_deg)) + 1e-12]
        wo.append(seen)
        wi.append(np.broadcast_to(light, seen.shape))
    return np.concatenate(wi), np.concatenate(wo)


def table_of(truth, wi: np.ndarray, wo: np.ndarray, noise: float = 0.02) -> ScatteredTable:
    f = truth(wi, wo)
    f = f * (1 + noise * np.random.default_rng(1).standard_normal(f.shape))
    return ScatteredTable(wi, wo, f, isotropic_brdf(Path("a"), "test", {}, ()))


def outside(table: ScatteredTable, wi: np.ndarray, wo: np.ndarray) -> tuple[float, float]:
    """Largest f over the brightest of the nearest tuples, and smallest over the darkest."""
    near = table._f[table._usable][table._tree.query(_place(wi, wo), k=NEIGHBOURS)[1]]
    f = table.eval(wi, wo)
    lit = near.max(axis=1) > 1e-6
    over, under = f[lit] / near.max(axis=1)[lit], near.min(axis=1)[lit] / np.maximum(f[lit], 1e-12)
    return float(over.max()), float(under.max())


@pytest.mark.parametrize("name", TRUTHS)
def test_no_value_is_outside_the_range_of_the_nearest_tuples(name, hemisphere):
    table = table_of(TRUTHS[name], *scan(hemisphere))
    over, under = outside(table, hemisphere(4000, 5), hemisphere(4000, 6))
    assert over <= 1 + 1e-9
    assert under <= 1 + 1e-9


@pytest.mark.long
def test_it_is_exact_at_tuples_continuous_and_reciprocal(hemisphere):
    wi, wo = scan(hemisphere)
    table = table_of(TRUTHS["sharp"], wi, wo)
    np.testing.assert_allclose(table.eval(wi, wo), table._f, rtol=1e-6)
    there, back = hemisphere(2000, 3), hemisphere(2000, 4)
    np.testing.assert_allclose(table.eval(there, back), table.eval(back, there), rtol=1e-5)
    steps = []
    for count in (10001, 100001):
        t = np.linspace(0.4, 0.6, count)
        f = table.eval(direction(1.3 * t, 0.3 + t), direction(1.2 - t, 2 + 3 * t))
        steps.append(float(np.abs(np.diff(np.log(f[:, 0]))).max()))
    assert steps[1] < steps[0] / 5


@pytest.mark.long
def test_it_says_where_nothing_was_measured(hemisphere):
    table = table_of(TRUTHS["rough"], *scan(hemisphere, about_light_deg=35))
    light = direction(np.full(200, 0.8), 0.0)
    about_light = normalize(light + np.random.default_rng(2).normal(0, 0.03, light.shape))
    assert table.extrapolates(light, about_light).mean() > 0.9
    assert table.extrapolates(light, direction(np.full(200, 1.5), 2.0)).all()
    assert table.extrapolates(hemisphere(500, 7, 60), hemisphere(500, 8, 60) * (-1, 1, 1)).mean() < 0.2
    (said,) = extrapolation(table)[1]
    assert "of the direction pairs" in said
    assert "within 20 degrees of the light" in said
    assert said in inspect_table(table)["findings"]


def test_a_table_measured_everywhere_extrapolates_nowhere(hemisphere):
    wi, wo = hemisphere(4000, 1, 89), hemisphere(4000, 2, 89)
    assert extrapolation(table_of(TRUTHS["rough"], wi, wo)) == (pytest.approx(0, abs=0.5), [])


THETA_I, THETA_O = (10.0, 40.0, 70.0), (20.0, 40.0, 60.0)


def mirrored(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """1/sr, the same where both are mirrored in x or in y, far from the same where only one is."""
    return 0.3 + 0.2 * wi[..., 0] * wo[..., 0] - 0.25 * wi[..., 1] * wo[..., 1]


def turned(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """1/sr, the same where both are turned by half a turn; without mirror symmetry."""
    return 0.3 + 0.2 * wi[..., 0] * wo[..., 1] - 0.1 * wi[..., 1] * wo[..., 1]


def rows_of(f, phi_i_deg, dphi: bool = False) -> list[tuple[float, ...]]:
    """Rows theta_i, phi_i, theta_o, phi_o or dphi, f."""
    angles = [
        (theta_i, phi_i, theta_o, phi_o)
        for theta_i in THETA_I for phi_i in phi_i_deg for theta_o in THETA_O for phi_o in range(0, 360, 15)
    ]  # fmt: skip
    a = np.radians(np.array(angles, float))
    value = f(direction(a[:, 0], a[:, 1]), direction(a[:, 2], a[:, 3]))
    around = [(phi_o - phi_i + 540) % 360 - 180 if dphi else phi_o for _, phi_i, _, phi_o in angles]
    return [(*row[:3], phi, v) for row, phi, v in zip(angles, around, value, strict=True)]


def text_of(names: str, rows: list[tuple[float, ...]]) -> str:
    return names + "\n" + "\n".join(" ".join(f"{value:.9g}" for value in row) for row in rows) + "\n"


ROUND = range(0, 360, 45)  # phi_i of all quarters, whose mirror images are in the files
GONIO = "theta_i phi_i theta_o phi_o f"


@pytest.mark.parametrize(
    ("head", "f", "phi_i_deg", "symmetry"),
    [
        ("# symmetry: quadrant\n", mirrored, (0, 45, 90), "quadrant"),
        ("", mirrored, (0, 45, 90), "quadrant"),
        ("# symmetry: half\n", turned, (0, 45, 90, 135), "half"),
        ("", turned, (0, 45, 90, 135), "half"),
        ("", lambda wi, wo: turned(wi, wo) + 0.1 * wi[..., 0], ROUND, "none"),
    ],
    ids=["quadrant, stated", "quadrant, spanned", "half, stated", "half, spanned", "none"],
)
def test_other_quarters_are_those_of_the_symmetry(loaded: Loaded, head, f, phi_i_deg, symmetry: str) -> None:
    table = loaded(head + text_of(GONIO, rows_of(f, phi_i_deg)))
    assert table.symmetry == symmetry
    angles = np.array([row[:4] for row in rows_of(f, ROUND)])
    wi, wo = (direction(*np.radians(angles[:, k : k + 2].T)) for k in (0, 2))
    np.testing.assert_allclose(table.eval(wi, wo)[:, 0], f(wi, wo), rtol=1e-5)


def test_a_zemax_file_over_a_quarter_is_mirrored(loaded: Loaded) -> None:
    table = loaded(zemax_text(lambda wi, wo: mirrored(wi, wo)[..., None], "Asymmetrical4D", rotations=(0, 45, 90)))
    samples = table.samples()
    np.testing.assert_allclose(samples.f[:, 0], mirrored(samples.wi, samples.wo), rtol=1e-4)
    for flip in ((-1, 1, 1), (1, -1, 1), (-1, -1, 1)):
        f = table.eval(samples.wi * flip, samples.wo * flip)
        np.testing.assert_allclose(f, samples.f, rtol=1e-4)


@pytest.mark.parametrize("name", ["dphi", "delta_phi(rad)"])
def test_dphi_is_phi_o_minus_phi_i(tmp_path: Path, name: str) -> None:
    path, phi_i_deg = tmp_path / "a", (0, 45, 90, 135)
    rows, names = rows_of(turned, phi_i_deg, dphi=True), f"theta_i phi_i theta_o {name} brdf"
    if "rad" in name:
        rows = [(*np.radians(row[:4]), row[4]) for row in rows]
    path.write_text(text_of(names, rows))
    table = load(path)
    samples = table.samples()
    assert len(samples) == len(rows)
    np.testing.assert_allclose(samples.f[:, 0], turned(samples.wi, samples.wo), rtol=1e-5)
    ahead = direction(np.radians(40), np.radians(45)), direction(np.radians(60), np.radians(75))  # dphi = 30
    assert table.eval(*ahead)[0] == pytest.approx(turned(*ahead), rel=1e-5)
    assert turned(*ahead) != pytest.approx(turned(ahead[0], direction(np.radians(60), np.radians(15))), rel=0.05)


COUNT = 12
GREY, RGB = (TableInfo("a", "test", True, False, channels, "f") for channels in (1, 3))


def collected(f: np.ndarray, theta_o: np.ndarray | float = 0.5) -> MeasuredSamples:
    wi, wo = direction(np.full(len(f), 0.3), 0.0), direction(np.broadcast_to(theta_o, len(f)), 1.0)
    return collect(wi, wo, f, np.ones(len(f)), GREY if f.shape[1] == 1 else RGB, np.zeros(len(f), bool))


def test_a_negative_channel_does_not_cost_the_tuple() -> None:
    f = np.full((COUNT, 3), (0.3, 0.2, -0.005))
    f[:4, 2] = 0.01
    samples = collected(f)
    np.testing.assert_array_equal(samples.f, f)
    assert samples.left_out.total == 0 and samples.counts["used"] == COUNT and samples.counts["below_zero"] == 8
    assert negative_readings(samples) == "8 of 12 tuples (67 %) are below zero: blue in 8, down to -0.005 /sr"
    assert negative_readings(collected(np.abs(f))) == ""


@pytest.mark.parametrize("mark", [-0.5, -50.0, -32768.0, -1e30])
def test_what_no_noise_reaches_is_no_reading(mark: float) -> None:
    """Other programs' marks: further below zero than the brightest tuple is above."""
    f = np.full((COUNT, 3), 0.3)
    f[3, 1] = mark
    samples = collected(f)
    assert len(samples) == COUNT - 1 and samples.left_out.not_finite == 1 and samples.below_zero == 0


def test_nothing_above_zero_is_nothing_measured() -> None:
    with pytest.raises(UserError, match="has no measured value"):
        collected(np.full((COUNT, 1), -0.1))


def test_marks_in_columns(loaded: Loaded) -> None:
    """Exactly -1, -99, -999 and -9999; numbers beside them are readings, and -.5 of a table up to 1.2 is one too."""
    values = [*MARKS, -0.01, -0.5, 0.2, 0.3, 1.2, 0.4, 0.5, 0.6]
    rows = [f"10 0 {t} {p}" for t in (20, 40, 60) for p in (0, 90, 180, 270)]
    samples = loaded(
        "\n".join(
            ["theta_i phi_i theta_o phi_o f", *(f"{row} {value}" for row, value in zip(rows, values, strict=True))]
        )
        + "\n"
    ).samples()
    assert samples.left_out.shadowed == len(MARKS) and samples.left_out.total == len(MARKS)
    assert samples.below_zero == 2 and len(samples) == len(values) - len(MARKS)


def test_marks_in_other_texts(loaded: Loaded) -> None:
    rows = cornell_rows()
    rows[2, 4:], rows[3, 6] = -1, -99
    assert loaded(cornell_text(rows, np.linspace(400, 700, 5))).samples().left_out.shadowed == 2
    blocks = {(30.0, 0.0): (np.array([(t, p) for t in (10, 20, 40) for p in (0, 120, 240)], float), np.full(9, 0.2))}
    blocks[30.0, 0.0][1][4] = -999
    assert loaded(fred_text(blocks)).samples().left_out.shadowed == 1
    zemax = zemax_text(lambda wi, wo: 0.2 + 0 * wo[..., 2:], "PlaneSymmetrical")
    for mark in ("-1", "0"):
        fewer = loaded(zemax.replace("2.000000e-01", mark, 1)).samples()
        assert len(loaded(zemax).samples()) == len(fewer) + 1 and fewer.below_zero == 0


def test_negative_merl_values_are_marks(loaded: Loaded) -> None:
    f = np.full((6, 6, 12, 3), 0.2)
    f[1, 1, :3, 2] = -0.001
    samples = loaded(merl_bytes(f)).samples()
    assert samples.left_out.shadowed == 3 and samples.below_zero == 0


def test_colours_of_noise_keep_their_sign() -> None:
    """A spectrum or XYZ with a reading below zero is noise; one without is a colour outside Rec.709."""
    nm = np.array([450.0, 550.0, 650.0])
    spectra = np.array([[-0.01, 0.2, 0.3], [0.0, 0.0, 0.3], [-0.02, -0.02, -0.02]])
    rgb, notes = rgb_of_measured(spectra, np.ones(3, bool), nm)
    assert rgb[0, 2] < 0 < rgb[0, 0] and rgb[1].min() == 0 and "1 spectra" in notes[-1]
    np.testing.assert_allclose(rgb[2], -0.02, rtol=1e-9)
    xyz, notes = rgb_of_xyz(np.array([[0.2, 0.2, -0.01], [0.3, 0.01, 0.01]]))
    assert xyz[0].min() < 0 and xyz[1].min() == 0 and "1 values" in notes[-1]


def test_colour_of_a_matrix_with_one_negative_reading(tmp_path: Path) -> None:
    """X, Y and Z of a patch: Z alone is below zero, and the light of the others stays."""
    y, z = np.full((145, 145), 0.2), np.full((145, 145), 0.2)
    z[0, 0] = -0.001
    path = tmp_path / "a"
    path.write_text(
        lbnl_xml("Columns", [(band, "Reflection Back", words(values)) for band, values in
                             (("Visible", y), ("CIE-X", y), ("CIE-Z", z))])
    )  # fmt: skip
    table, up = read_xml(path), direction(0.01, 0.0)
    f = table.eval(up, up)
    assert f[2] == 0 and f[0] > 0.15 and f[1] > 0.15
    assert table.samples().below_zero == 9


THETA_DEG, PHI_DEG = np.arange(0, 81, 10.0), np.arange(0, 360, 30.0)


def sheets_of(f: np.ndarray) -> dict[str, AnySheet]:
    """The readings f (T, P, 1) as a grid, as scattered directions, and one column of them as a scan in a plane."""
    grid = Sheet(THETA_DEG, PHI_DEG, f)
    once = np.r_[0, len(PHI_DEG) : f[..., 0].size]
    scan = once[once % len(PHI_DEG) == 0]
    images = np.zeros(len(once), bool)
    return {
        "grid": grid,
        "scattered": ScatteredSheet(grid.directions[once], grid.values[once], np.eye(3), images),
        "scan": ScatteredSheet(grid.directions[scan], grid.values[scan], np.eye(3), images[: len(scan)]),
    }


def gonio(sheet: AnySheet) -> GonioTable:
    return GonioTable("dark", np.zeros(1), np.zeros(1), ((sheet,),), reconstruction="quadrilinear")


@pytest.mark.parametrize("kind", ["grid", "scattered", "scan"])
def test_gonio_readings_below_zero_cancel_those_above(kind: str) -> None:
    """Half-way between readings of .03 and -.01 f is .01; clamped at the readings it would be .015."""
    f = np.where(np.arange(len(THETA_DEG))[:, None, None] % 2, -0.01, 0.03) * np.ones((1, len(PHI_DEG), 1))
    table = gonio(sheets_of(f)[kind])
    theta = np.radians(np.array([25.0, 45.0, 30.0, 40.0]))
    found = table.eval(np.broadcast_to([0.0, 0.0, 1.0], (4, 3)), direction(theta, 0 * theta))
    np.testing.assert_allclose(found[:, 0], [0.01, 0.01, 0.0, 0.03], atol=1e-5)


@pytest.mark.parametrize("kind", ["grid", "scattered", "scan"])
def test_a_mark_below_zero_darkens_no_gonio_reading_beside_it(kind: str) -> None:
    f = np.full((len(THETA_DEG), len(PHI_DEG), 1), 0.2)
    f[3, 0] = -32768
    theta = np.radians(np.array([25.0, 29.0, 33.0]))
    found = gonio(sheets_of(f)[kind]).eval(np.broadcast_to([0.0, 0.0, 1.0], (3, 3)), direction(theta, 0 * theta))
    np.testing.assert_allclose(found, 0.2, rtol=1e-6)


WHITE = (1.0, 1.0, 1.0)
BRUSHED = Material(
    name="brushed", kd=(0.05,) * 3, lobes=(Lobe(mx=0.2, my=0.1, r0=WHITE, k=(0.8, 0.7, 0.6), alpha=0.5),)
)
FOIL = Material(
    name="foil",
    kd=(0.3,) * 3,
    lobes=(Lobe(side="transmission", mx=0.25, my=0.25, k=(0.6, 0.6, 0.6), r0=(0.1,) * 3, alpha=0.5),),
)
CLEAN = {"noise": 0.0, "floor": 0.0}


@pytest.mark.long
def test_text_round_trip(tmp_path: Path) -> None:
    for material, setup in ((BRUSHED, ANISOTROPIC), (FOIL, ISOTROPIC)):
        table = synthesise(material, replace(setup, step_deg=10, fine_deg=5))
        for quantity in ("f", "f_cos", "p"):
            path = tmp_path / "table.txt"
            write_gonio(path, table, quantity)
            back = load(path)
            assert back.info.stored == quantity and back.info.file == "table.txt"
            assert (back.symmetry, back.name) == (table.symmetry, material.name)
            ours, theirs = table.samples(), back.samples()
            assert ours.left_out == theirs.left_out and ours.left_out.shadowed > 0
            np.testing.assert_allclose(theirs.f, ours.f, rtol=2e-5)
            np.testing.assert_allclose(theirs.wo, ours.wo, atol=1e-7)
            np.testing.assert_allclose(theirs.weight, ours.weight, rtol=1e-3)


def test_not_measured_negative_and_separators(tmp_path: Path) -> None:
    path = tmp_path / "a"
    values = iter(["nan", "-1", "-0.001", "inf", "0.2", "0.3", "0.4", "0.5"])
    rows = "".join(f"0, 0, {t}, {p}, {next(values)}\n" for t in (0, 40) for p in (0, 90, 180, 270))
    path.write_text(f"# comment\n\ntheta_i, phi_i, theta_o, phi_o, f\n{rows}")
    samples = load(path).samples()
    assert (samples.left_out.shadowed, samples.below_zero) == (3, 1) and samples.f.min() == -0.001
    assert "symmetry not stated" in load(path).info.notes[0]


def test_transmission_is_beyond_90_degrees() -> None:
    table = synthesise(FOIL, replace(ISOTROPIC, **CLEAN))
    samples = table.samples()
    assert table.info.transmits and samples.transmitted.any() and (samples.wi[:, 2] > 0).all()
    truth = MaterialBSDF(FOIL)
    np.testing.assert_allclose(truth.eval(samples.wi, samples.wo), samples.f, rtol=1e-9)
    wi = direction(np.radians([0, 20, 45]), 0.0)
    np.testing.assert_allclose(table.albedo(wi), truth.albedo(wi, samples=16384), rtol=0.03)
    np.testing.assert_allclose(table.reflectivity(wi), 0.3, rtol=0.02)
    np.testing.assert_allclose(table.eval(wi * (1, 1, -1), wi * (-1, -1, 1)), table.eval(wi, wi * (-1, -1, -1)))


def test_weights_tile_the_hemisphere() -> None:
    samples = synthesise(GLOSSY, replace(ISOTROPIC, sector_deg=0, grazing_deg=84, **CLEAN)).samples()
    one = samples.wi[:, 2] == samples.wi[0, 2]
    last_edge = np.radians(82.5 + 1.25)
    assert samples.weight[one].sum() == pytest.approx(2 * np.pi * (1 - np.cos(last_edge)), rel=1e-6)


def test_isotropic_table_turns_with_the_pair(hemisphere) -> None:
    table = synthesise(GLOSSY, replace(ISOTROPIC, step_deg=5, fine_deg=5))
    wi, wo = hemisphere(100, 1), hemisphere(100, 2)
    c, s = np.cos(1.1), np.sin(1.1)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    np.testing.assert_allclose(table.eval(wi @ turn.T, wo @ turn.T), table.eval(wi, wo), rtol=1e-6, atol=1e-9)


def test_half_a_turn_of_an_isotropic_table_is_mirrored(loaded: Loaded) -> None:
    rows = "".join(f"20 0 {t} {p} {0.1 + p / 1000}\n" for t in (0, 30, 60) for p in (0, 60, 120, 180))
    table = loaded(f"# symmetry: isotropic\ntheta_i phi_i theta_o phi_o f\n{rows}")
    wi, wo = direction(np.radians(20), 0.0), direction(np.radians(30), np.radians(np.array([60.0, 300.0])))
    quadrilinear = replace(table, reconstruction="quadrilinear")
    np.testing.assert_allclose(quadrilinear.eval(np.broadcast_to(wi, (2, 3)), wo)[:, 0], 0.16)


def test_impossible_setups() -> None:
    for change in ({"theta_i_deg": (0, 95)}, {"fine_deg": 9.0}, {"phi_i_deg": (0.0, 90.0)}, {"theta_i_deg": (20, 10)}):
        with pytest.raises(UserError):
            replace(ISOTROPIC, **change)
