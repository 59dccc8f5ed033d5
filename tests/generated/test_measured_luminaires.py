"""Photometric files with oddities: what is said of them, and what is taken."""

from __future__ import annotations

from pathlib import Path

import pytest

import lambent
from lambent.core.errors import UserError
from tests.scenes.photometry.written_files import ies, ldt

AROUND = "0 90 180 270 360"
PLANES = "100 70 0 100 60 0 100 50 0 100 60 0 100 {} 0"
ODD = {
    "below zero": (
        ies(candela="100 -5 0"),
        "are below zero, down to -5; they count as 0",
    ),
    "below zero, EULUMDAT": (ldt([(100, -5)]), "1 of 2 intensities (0.5 of all) are below zero"),
    "planes differ": (ies(horizontal=AROUND, candela=PLANES.format(20)), "planes 0 and 360 differ, by up to 50"),
    "more than promised": (ies() + "5 5 5\n", "3 numbers follow the last that the file promises; they are ignored"),
    "dark": (ies(candela="0 0 0"), "gives no light"),
}


@pytest.fixture
def findings(tmp_path: Path):
    def found(text: str) -> list[str]:
        path = tmp_path / "lamp.ies"
        path.write_text(text)
        return lambent.read(path).facts()["findings"]

    return found


@pytest.mark.parametrize("name", ODD)
def test_what_is_not_taken_as_it_is(findings, name: str) -> None:
    text, expected = ODD[name]
    lines = findings(text)
    assert any(expected in line for line in lines) and len(lines) <= 8


def test_equal_planes_at_0_and_360_are_no_fault(findings) -> None:
    assert findings(ies(horizontal=AROUND, candela=PLANES.format(70))) == ["no faults found"]


@pytest.mark.parametrize("units, side_m", [(1, 0.1524), (2, 0.5)])
def test_feet_and_metres(tmp_path: Path, units: int, side_m: float) -> None:
    path = tmp_path / "lamp.ies"
    path.write_text(ies(units=units))
    assert f"{side_m:g}" in lambent.read(path).facts()["opening"]


def test_decimal_commas_are_not_read_as_two_numbers(findings) -> None:
    with pytest.raises(UserError, match="replace the decimal commas by points"):
        findings(ies(candela="100,5 70,2 0,0"))
    assert findings(ies(candela="100, 70, 0")) == ["no faults found"]
