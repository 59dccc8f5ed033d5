"""EULUMDAT files: every symmetry by hand, lamps, notations of other programs, and hostile ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.scenes.photometry.files import read_luminaire
from lambent.scenes.photometry.inspection import facts_of
from lambent.scenes.photometry.luminaire import Luminaire
from tests.scenes.photometry.written_files import ldt, ldt_of, lobe

EIGHTH = tuple(range(0, 360, 45))


def read(folder: Path, text: str | bytes) -> Luminaire:
    path = folder / "lamp.ldt"
    path.write_bytes(text if isinstance(text, bytes) else text.encode("latin-1"))
    return read_luminaire(path)


def towards(luminaire: Luminaire, gamma_deg: object, c_deg: object, lamp_set: int = 0) -> np.ndarray:
    return luminaire.photometry(lamp_set).at(np.asarray(gamma_deg, float), np.asarray(c_deg, float))


@pytest.mark.parametrize(
    ("symmetry", "rows", "around"),
    [
        (0, (1, 2, 3, 4, 5, 6, 7, 8), (1, 2, 3, 4, 5, 6, 7, 8)),
        (1, (5,), (5,) * 8),
        (2, (1, 2, 3, 4, 5), (1, 2, 3, 4, 5, 4, 3, 2)),  # C0 to C180 given
        (3, (1, 2, 3, 4, 5), (3, 4, 5, 4, 3, 2, 1, 2)),  # C270 by C0 to C90 given
        (4, (1, 2, 3), (1, 2, 3, 2, 1, 2, 3, 2)),  # C0 to C90 given
    ],
)
def test_every_symmetry(tmp_path: Path, symmetry: int, rows: tuple[int, ...], around: tuple[int, ...]) -> None:
    made = read(tmp_path, ldt([(one, 0) for one in rows], symmetry=symmetry, c_deg=EIGHTH))
    assert towards(made, [0] * 8, EIGHTH) == pytest.approx(around)
    between = (around[0] + np.array(around[1])) / 2
    assert towards(made, [45], [22.5]) == pytest.approx(between / 2)
    whole = read(tmp_path, ldt([(one, 0) for one in around], symmetry=symmetry, c_deg=EIGHTH))
    assert whole.values == made.values or symmetry == 1, "a program may write every plane nevertheless"


def test_planes_that_do_not_start_at_0_or_miss_a_quarter(tmp_path: Path) -> None:
    made = read(tmp_path, ldt([(1, 0), (3, 0)], symmetry=0, c_deg=(90, 270)))
    assert towards(made, [0] * 4, (90, 180, 270, 0)) == pytest.approx([1, 2, 3, 2])
    made = read(tmp_path, ldt([(k, 0) for k in range(5)], symmetry=4, c_deg=tuple(range(0, 360, 20))))
    assert towards(made, [0] * 6, (0, 80, 90, 100, 190, 350)) == pytest.approx([0, 4, 4, 4, 0.5, 0.5])


def test_known_fluxes(tmp_path: Path) -> None:
    """4 pi I, pi I, 2 pi I / (n + 1)."""
    even = read(tmp_path, ldt([(100, 100, 100)], gamma_deg=(0, 90, 180)))
    assert even.photometry().lumens == pytest.approx(400 * np.pi)
    assert even.photometry().lumens_within(90) == pytest.approx(200 * np.pi)
    for exponent, factor in ((1, np.pi), (8, 2 * np.pi / 9)):
        made = read(tmp_path, ldt_of(lobe(exponent), [0], np.linspace(0, 90, 91).tolist(), 1))
        assert made.photometry().lumens == pytest.approx(1000 * factor, rel=1e-3)
        assert towards(made, [0, 60, 90.1, 180], [0, 77, 0, 0]) == pytest.approx([1000, 1000 * 0.5**exponent, 0, 0])


def test_lamps_are_alternatives_and_scale_the_light(tmp_path: Path) -> None:
    made = read(tmp_path, ldt([(200, 0)], sets=((1, 500), (2, 1200)), factor=2.0, tilt=15))
    assert [towards(made, [0], [0], k) for k in (0, 1)] == [pytest.approx([200]), pytest.approx([480])]
    assert [(one.count, one.kind, one.colour, one.watts) for one in made.sets][1] == (
        2,
        "lamp of 1200 lm",
        "3000 K",
        20,
    )
    assert (made.measured_tilt_deg, made.absolute) == (15, False)
    with pytest.raises(UserError, match=r"lamp_set: has no such lamp set; found 2; expected 0 to 1"):
        made.photometry(2)


def test_absolute_and_relative_have_the_same_light(tmp_path: Path) -> None:
    """A negative number of lamps: the flux is the luminaire's, of which 100 % come out."""
    relative = read(tmp_path, ldt([(800 / np.pi, 0)], sets=((2, 1000),), percent=(100, 80)))
    absolute = read(tmp_path, ldt([(1000 / np.pi, 0)], sets=((-2, 800),)))
    assert absolute.absolute and absolute.sets[0].count == 2
    assert towards(relative, [0, 45], [0, 0]) == pytest.approx(towards(absolute, [0, 45], [0, 0]))
    assert facts_of(relative)["light_output_ratio"]["stated"] == 0.8


def test_lamps_without_flux(tmp_path: Path) -> None:
    made = read(tmp_path, ldt([(200, 0)], sets=((1, 0),)))
    with pytest.raises(UserError, match="lamp_set: has no luminous flux; found 0; write it into the file"):
        made.photometry()
    assert "no flux" in facts_of(made)["findings"][0]


def test_notations_of_other_programs(tmp_path: Path) -> None:
    plain = ldt([(200.5, 0.25)], area_mm=(600, 300, 0, 0, 0, 0), name="Leuchte grün")
    made = read(tmp_path, plain)
    assert (made.name, made.maker, made.report, made.format) == ("Leuchte grün", "Maker", "R 1", "EULUMDAT")
    header = plain.split("\n")
    ratios = header[:32] + [""] * 10 + header[42:]
    for other in (
        plain.replace(".", ","), plain.replace("\n", "\r\n"), plain.replace("\n", "\r\r\n"), plain.replace("\n", "\r"),
        plain.rstrip("\n"), plain + "\n\n\x1a", plain + "written by a program\n", "\n".join(ratios),
        plain.replace("\n1.0\n", "\n0\n", 1),
    ):  # fmt: skip
        assert read(tmp_path, other).values == made.values, other
    assert read(tmp_path, b"\xef\xbb\xbf" + plain.encode()).name == made.name


@pytest.mark.parametrize(
    ("area_mm", "words"),
    [
        ((0, 0, 0, 0, 0, 0), "point"),
        ((1200, 300, 0, 0, 0, 0), "rectangle, 0.3 x 1.2 x 0 m"),  # C0 is across
        ((1200, 300, 50, 50, 50, 50), "box, 0.3 x 1.2 x 0.05 m"),
        ((200, 0, 0, 0, 0, 0), "disc, 0.2 x 0.2 x 0 m"),
        ((200, 0, 100, 100, 0, 0), "cylinder, 0.2 x 0.2 x 0.1 m"),
    ],
)
def test_luminous_areas(tmp_path: Path, area_mm: tuple[float, ...], words: str) -> None:
    assert str(read(tmp_path, ldt([(1, 0)], area_mm=area_mm)).values.opening) == words


SOUND = ldt([(200, 0)])


def changed(line: int, new: object) -> str:
    lines = SOUND.split("\n")
    lines[line - 1] = str(new)
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "is not an EULUMDAT file; found 1 lines; expected 26 or more"),
        ("\x00\xff\n" * 40, "symmetry .line 3.: is not a number"),
        ("Lorem ipsum dolor\n" * 60, "is not a number; found Lorem"),
        (changed(3, 5), "symmetry .line 3.: is out of range; found 5; expected 0 to 4"),
        (changed(3, 1.5), "whole number"),
        (changed(4, -3), "number of C planes .line 4.: is out of range"),
        (changed(4, 10**9), "expected 1 to 4096"),
        (changed(6, 1), "number of gamma angles .line 6.: is out of range"),
        (changed(26, 0), "number of lamp sets"),
        (changed(26, 3), "truncated"),
        (changed(26, 19), "truncated"),
        (changed(29, "nan"), "luminous flux .line 29.: is out of range; found nan"),
        (changed(24, "inf"), "conversion factor"),
        (changed(16, 1e99), "luminous area"),
        (SOUND[: SOUND.rindex("200")], "intensities: file is truncated; found 0; expected 2"),
        (SOUND.replace("\n200\n", "\nnan\n"), "numbers are not finite"),
        (SOUND.replace("\n200\n", "\n1e30\n"), "intensities: are out of range"),
        (ldt([(1, 2)], gamma_deg=(90, 0)), "gamma angles: angles do not increase"),
        (ldt([(1, 2)], gamma_deg=(0, 190)), "gamma angles: are outside 0 to 180 degrees; found 0 to 190"),
        (ldt([(1, 2)], gamma_deg=(-10, 90)), "gamma angles: are outside 0 to 180"),
        (ldt([(1, 2), (1, 2)], symmetry=0, c_deg=(180, 0)), "C planes: angles do not increase"),
    ],
)
def test_what_is_refused(tmp_path: Path, text: str, word: str) -> None:
    with pytest.raises(UserError, match=word) as caught:
        read(tmp_path, text)
    assert "\n" not in str(caught.value) and "cannot be read as" not in str(caught.value)


def by_zones(path: Path) -> float:
    """cd/klm over the sphere by the midpoints of fine zones, straight from the file's numbers: axial files only."""
    numbers = [float(line) for line in path.read_text().split("\n") if line.replace(".", "").isdigit()]
    angles, values = np.array(numbers[-74:-37]), np.array(numbers[-37:])
    fine = np.radians(np.linspace(0, 90, 90_001))
    middle = (fine[1:] + fine[:-1]) / 2
    return float(2 * np.pi * (np.interp(np.degrees(middle), angles, values) * np.sin(middle)).sum() * fine[1])


def test_files_of_another_program(shared_data: Path) -> None:
    """Test files of a viewer: their intensities are made up, which the check against the stated flux says."""
    folder = shared_data / "luminaires"
    found = {path.stem: read_luminaire(path) for path in sorted(folder.glob("*.ldt"))}
    assert {name: one.symmetry for name, one in found.items()} == {
        "absolute": "about the axis", "multiple_lamp_sets": "about the axis", "no_symmetry": "none",
        "relative": "about the axis", "symmetry_to_c0c180": "to C0-C180",
    }  # fmt: skip
    axial = by_zones(folder / "relative.ldt")
    assert [found[name].values.lumens for name in ("relative", "absolute")] == pytest.approx([axial] * 2, rel=1e-5)
    several = found["multiple_lamp_sets"]
    assert [several.photometry(k).lumens / axial for k in range(3)] == pytest.approx([0.5, 1.2, 0.5], rel=1e-5)
    assert [one.absolute for one in found.values()] == [True, False, True, False, True]
    assert {name: facts_of(one)["findings"] for name, one in found.items()} == {
        "absolute": ["intensities add up to 452.3 lm; the file states 500 lm"],
        "multiple_lamp_sets": ["intensities add up to 452.3 lm; the file states 500 lm"],
        "no_symmetry": ["intensities add up to 3722 lm; the file states 1000 lm"],
        "relative": ["intensities add up to 452.3 lm; the file states 500 lm"],
        "symmetry_to_c0c180": ["intensities add up to 3141 lm; the file states 1000 lm"],
    }
    numbers = np.array((folder / "no_symmetry.ldt").read_text().split()[-24 - 37 - 24 * 37 :], float)
    c, gamma, values = np.split(numbers, [24, 61])
    assert towards(found["no_symmetry"], *np.meshgrid(gamma, c)) == pytest.approx(values.reshape(24, 37))
