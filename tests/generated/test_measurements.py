"""What a person with such a file reads: the right table and what is worth knowing, or one line that says what to do."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lambent
from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.measured import load
from tests.generated import measurements as made

MOST_LINES = 8
WI = direction(np.radians([0.0, 30.0]), 0.0)
SATIN = MaterialBSDF(made.SATIN).albedo(WI, 128)
INTEGRATED = 0.01  # of the albedo: a table in steps of 5 and 15 degrees
Read = Callable[[str | bytes], Any]


@pytest.fixture
def read(tmp_path: Path) -> Read:
    def reading(content: str | bytes) -> Any:
        path = tmp_path / "sample.txt"
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return load(path)

    return reading


@pytest.fixture
def said(tmp_path: Path, read: Read) -> Callable[[str | bytes], list[str]]:
    """Notes and findings of `lambent inspect`, which are few."""

    def saying(content: str | bytes) -> list[str]:
        read(content)
        facts = lambent.read(tmp_path / "sample.txt").facts()
        lines = [*facts["notes"], *facts["findings"]]
        assert len(lines) <= MOST_LINES
        return lines

    return saying


@pytest.fixture
def refused(tmp_path: Path, read: Read) -> Callable[[str | bytes], str]:
    def refusing(content: str | bytes) -> str:
        with pytest.raises(UserError) as error:
            read(content)
        return str(error.value).partition("sample.txt: ")[2]

    return refusing


def assert_satin(table: Any) -> None:
    np.testing.assert_allclose(table.albedo(WI), SATIN, rtol=INTEGRATED, atol=0.003)


def elevated() -> str:
    angles_deg = made.grid()
    f = made.measured(angles_deg)
    angles_deg[:, [0, 2]] = 90 - angles_deg[:, [0, 2]]
    return made.written(angles_deg, f, ("elevation_i", "azimuth_i", "elevation_o", "azimuth_o", *made.RGB))


def turned() -> str:
    angles_deg = made.grid()
    f = made.measured(angles_deg)
    angles_deg[:, 3] -= 360 * (angles_deg[:, 3] > 180)
    return made.written(angles_deg, f)


def outgoing_first() -> str:
    angles_deg = made.grid()
    names = [*np.roll(made.ANGLES, 2), *made.RGB]
    return made.written(np.roll(angles_deg, 2, axis=1), made.measured(angles_deg), names)


def repeated() -> str:
    angles_deg = made.grid()
    f = made.measured(angles_deg)
    return made.written(np.vstack([angles_deg] * 2), np.vstack([0.9 * f, 1.1 * f]))


def commented() -> str:
    head, *rows = made.satin().split("\n")
    return "\n".join([head, *rows[:40], "# the lamp was replaced", *rows[40:50], "", "% cold", "// warm", *rows[50:]])


SOUND = {
    "as it should be": made.satin(),
    "outgoing angles first": outgoing_first(),
    "phi from -180 to 180": turned(),
    "elevation for zenith angles": elevated(),
    "zenith and azimuth": made.satin(("zenith_i", "azimuth_i", "zenith_o", "azimuth_o", *made.RGB)),
    "repeated": repeated(),
    "tabs": made.satin(separator="\t"),
    "semicolons": made.satin(separator=";"),
    "decimal commas": made.satin(separator=";").replace(".", ","),
    "byte order mark": b"\xef\xbb\xbf" + made.satin().encode(),
    "line ends of Windows": made.satin().replace("\n", "\r\n"),
    "Latin-1": "# name: gebürstet, 5°\n".encode("latin-1") + made.satin().encode(),
    "comments between rows": commented(),
    "words for nothing": made.damaged(made.satin(), 0.1, "N/A -- 1.#QNAN")[0],
    "empty cells": made.damaged(made.satin(separator=","), 0.1, ",,")[0],
    "-999": made.damaged(made.satin(), 0.1, "-999 -999 -999")[0],
    "nan": made.damaged(made.satin(), 0.1, "nan nan nan")[0],
}


@pytest.mark.parametrize("name", SOUND)
def test_the_table_is_that_of_the_material(read: Read, name: str) -> None:
    assert_satin(read(SOUND[name]))


@pytest.mark.parametrize(("cells", "separator"), [("N/A -- null", " "), (",,", ","), ("-999 -999 -999", " ")])
def test_missing_values_are_counted(read: Read, said, cells: str, separator: str) -> None:
    text, count = made.damaged(made.satin(separator=separator), 0.12, cells)
    assert "12 % of the tuples are not measured" in " ".join(said(text)) and count > 100
    assert read(text).samples().left_out.shadowed > 0.8 * count  # the pole is one tuple for 24 rows


def test_notes_say_what_was_taken(said) -> None:
    assert "elevations count from the surface: theta is 90 degrees less the elevation" in said(elevated())
    assert "decimal commas are read as points" in said(made.satin(separator=";").replace(".", ","))
    assert any("repeat a direction; their mean was taken" in line for line in said(repeated()))


def test_negative_readings_are_counted(said) -> None:
    text, count = made.damaged(made.satin(), 0.12, "-.01 -.01 -.01")
    line = next(line for line in said(text) if "below zero" in line)
    assert "(12 %) are below zero" in line and "down to -0.01 /sr" in line and "use 0" in line and count > 100


def test_clipped_peaks_are_seen(said) -> None:
    angles_deg = made.grid(theta_o=range(0, 86, 2), phi_o=range(0, 360, 10))
    f = made.measured(angles_deg, made.GLOSSY)
    assert not any("saturated" in line for line in said(made.written(angles_deg, f)))
    assert any("seems saturated" in line for line in said(made.written(angles_deg, np.minimum(f, 0.3 * f.max()))))


ROW = "0 0 0 285"
REFUSED = {
    "a value more": (made.with_line(made.satin(), 21, f"{ROW} .1 .1 .1 7"), "line 21: a row does not have one value"),
    "shifted": (
        made.with_line(made.with_line(made.satin(), 21, "0 0 285 .1 .1 .1"), 22, "0 0 0 300 .1 .1 .1 3"),
        "line 21: a row does not have one value",
    ),
    "a word": (made.with_line(made.satin(), 21, f"{ROW} .1 x7 .1"), "line 21: has a word that is not a number"),
    "cut": (made.satin()[:-12], "line 1729: a row does not have one value"),
    "no angle": (made.with_line(made.satin(), 21, "0 0 N/A 0 .1 .1 .1"), "measurement 20: an angle is outside"),
    "elevations named theta": (elevated().replace("elevation", "theta").replace("azimuth", "phi"), "elevation_i"),
    "decimal commas between commas": (made.satin(separator=", ").replace(".", ","), "decimal commas"),
    "percent": (made.grey((*made.ANGLES, "R[%]"), 100 * np.pi), "values are in percent; expected 1/sr"),
    "a wavelength of nothing": (made.grey((*made.ANGLES, "550nm")), "put the quantity before each wavelength"),
    "unknown names": (
        made.grey(("Incident angle", "Incident azimuth", "Scatter angle", "Scatter azimuth", "BRDF")),
        "name the columns in the first line: theta_i phi_i theta_o phi_o",
    ),
    "UTF-16": (made.satin().encode("utf-16"), "save it again as UTF-8"),
    "UTF-16 without a mark": (made.satin().encode("utf-16-le"), "save it again as UTF-8"),
    "empty": ("", "file is empty"),
    "blank": ("\n \n", "file is empty"),
    "names alone": (made.satin().split("\n")[0] + "\n", "has no rows"),
    "a header that promises more": (
        "NUM_POINTS 5000\nVARS theta_i,phi_i,theta_s,phi_s,R,G,B\n" + made.satin().split("\n", 1)[1],
        "NUM_POINTS: wrong number of tuples; found 5000; expected 1728",
    ),
    ".xls": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), "Excel workbook (.xls), which is not supported; save"),
    ".xlsx": (b"PK\x03\x04" + bytes(26) + b"[Content_Types].xml" + bytes(99), "Excel workbook (.xlsx)"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_one_line_says_what_to_do(refused, name: str) -> None:
    content, expected = REFUSED[name]
    line = refused(content)
    assert expected in line and "\n" not in line


@pytest.mark.parametrize("scale", [1e6, 1e-9, 100 * np.pi])
def test_another_unit_is_seen(said, scale: float) -> None:
    """Values that no material has; they are read as they are."""
    assert any("are the values in 1/sr" in line for line in said(made.grey(scale=scale)))
    assert not any("are the values in 1/sr" in line for line in said(made.grey()))


@pytest.mark.parametrize("name", ["f_550nm", "brdf(550nm)", "brdf@550nm"])
def test_one_wavelength_is_grey(read: Read, said, name: str) -> None:
    text = made.grey((*made.ANGLES, name))
    assert "measured at 550 nm alone: taken as grey" in said(text)
    np.testing.assert_allclose(read(text).albedo(WI), SATIN[:, :1], rtol=INTEGRATED)


def test_wavelengths_are_put_in_order(read: Read) -> None:
    nm = np.linspace(400, 700, 16)
    shuffled = np.random.default_rng(0).permutation(16)
    in_order, out_of_order = (
        read(made.grey((*made.ANGLES, *(f"f_{w:g}nm" for w in order)), (order / 550) ** 2))
        for order in (nm, nm[shuffled])
    )
    np.testing.assert_allclose(in_order.albedo(WI), out_of_order.albedo(WI), rtol=1e-6)
    assert (np.diff(in_order.albedo(WI), axis=1) < 0).all(), "f that grows with the wavelength is reddish"


def test_incident_angles_that_begin_late_or_are_one(read: Read, said) -> None:
    assert any("one angle of incidence, 40 degrees" in line for line in said(made.grey(angles_deg=made.grid((40,)))))
    late = read(made.grey(angles_deg=made.grid((40, 60))))
    at = direction(np.radians([40.0]), 0.0)
    np.testing.assert_allclose(late.albedo(at), MaterialBSDF(made.SATIN).albedo(at, 128)[:, :1], rtol=INTEGRATED)


def test_a_peak_between_the_angles_is_said(said) -> None:
    """A mirror and a gloss trap: the grid holds one tuple of a needle, so its energy is a guess."""
    for material in (made.MIRROR, made.TRAP):
        angles_deg = made.grid(theta_o=range(0, 86, 2), phi_o=range(0, 360, 10))
        lines = said(made.written(angles_deg, made.measured(angles_deg, material)))
        assert any("the peak is under-sampled" in line for line in lines), material.name
        assert not any("are the values in 1/sr" in line for line in lines), material.name


def test_a_tape_is_retro_reflective_and_not_saturated(said) -> None:
    """At theta_o = 0 the grid repeats one reading: no device's limit."""
    around = [*range(0, 360, 15), 1, 2, 358, 359]
    near = [t + d for t in range(0, 61, 10) for d in (-4, -2, -1, 1, 2, 4) if t + d >= 0]
    angles_deg = made.grid(range(0, 61, 10), (0,), sorted({*range(0, 86, 5), *near}), around)
    lines = said(made.written(angles_deg, made.tape(angles_deg), (*made.ANGLES, "f")))
    assert any("is retro-reflective" in line for line in lines)
    assert not any("saturated" in line for line in lines)


def test_a_fabric_keeps_its_direction(read: Read) -> None:
    angles_deg = made.grid(phi_i=(0, 30, 60, 90), phi_o=range(0, 360, 10))
    table = read(made.written(angles_deg, made.measured(angles_deg, made.FABRIC)))
    assert not table.info.isotropic
    wi, truth = direction(np.radians([40.0, 40.0]), np.radians([0.0, 90.0])), MaterialBSDF(made.FABRIC)
    wo = direction(np.radians([55.0, 55.0]), np.radians([180.0, 270.0]))
    np.testing.assert_allclose(table.eval(wi, wo), truth.eval(wi, wo), rtol=0.02)


@pytest.mark.long
def test_half_a_million_rows(read: Read) -> None:
    angles_deg = made.grid(range(0, 80, 5), (0,), range(0, 87), range(360))
    assert len(angles_deg) > 500_000
    table = read(made.grey(angles_deg=angles_deg))
    np.testing.assert_allclose(table.albedo(WI), SATIN[:, :1], rtol=INTEGRATED)


@pytest.mark.slow
def test_a_fit_has_the_material_s_albedo(tmp_path: Path, read: Read) -> None:
    """12 % of the readings are missing."""
    read(made.damaged(made.satin(), 0.12, "nan nan nan")[0])
    fit = lambent.read(tmp_path / "sample.txt").fit(1)
    np.testing.assert_allclose(fit.material.albedo(WI), SATIN, rtol=0.02)


@pytest.mark.parametrize(
    "line",
    [
        "theta_i theta_o " + "9" * 4096,  # a word that might be a wavelength
        "# name: x" + " " * 60_000 + "y",
        "theta_i" + " " * 60_000 + "theta_o",
        "VARS theta_i theta_o " + "theta_i=" * 8000,
        "A" + " " * 20_000 + "\nVARS theta_i theta_s f",
    ],
    ids=["digits", "comment", "blanks", "VARS", "keyword"],
)
def test_long_lines_take_no_minutes(tmp_path: Path, line: str) -> None:
    """Found by fuzzing: time that grows with the square or the cube of a line's length."""
    from tests.reliability.mutate import within

    path = tmp_path / "sample.txt"
    path.write_text(f"{line}\n30 0 .1 .1\n")
    with within(5.0), pytest.raises(UserError):
        load(path)
