"""Readings below zero are noise about zero and stay tuples; marks of what was not measured are no readings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.measured.lbnl_xml import read as read_xml
from lambent.materials.measured.parts.spectral import rgb_of_measured, rgb_of_xyz
from lambent.materials.measured.protocol import MeasuredSamples, TableInfo, collect, negative_readings
from lambent.materials.measured.tables.gonio import AnySheet, GonioTable
from lambent.materials.measured.tables.sheets import ScatteredSheet, Sheet
from lambent.materials.measured.tables.table import MARKS
from tests.materials.measured.lbnl_files import lbnl_xml, words
from tests.materials.measured.measured_files import (
    Loaded,
    cornell_rows,
    cornell_text,
    fred_text,
    merl_bytes,
    zemax_text,
)

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
    fewer = loaded(
        zemax_text(lambda wi, wo: 0.2 + 0 * wo[..., 2:], "PlaneSymmetrical").replace("2.000000e-01", "-1", 1)
    ).samples()
    assert (
        len(loaded(zemax_text(lambda wi, wo: 0.2 + 0 * wo[..., 2:], "PlaneSymmetrical")).samples()) == len(fewer) + 1
        and fewer.below_zero == 0
    )


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
