"""IES files: every form of the standard by hand, hostile ones; where the angles of types A and B lead."""

from __future__ import annotations

import importlib.util
import subprocess
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.scenes.photometry.distribution import Photometry
from lambent.scenes.photometry.files import read_luminaire
from lambent.scenes.photometry.luminaire import Luminaire
from lambent.scenes.scene import IesLight
from tests.scenes.photometry.written_files import HEADS, Light, ies, ies_of, ldt_of, lobe


def read_ies(path: Path) -> Photometry:
    return read_luminaire(path).photometry()


def written(folder: Path, text: str) -> Path:
    path = folder / "lamp.ies"
    path.write_bytes(text.encode("latin-1"))
    return path


def test_a_downlight(tmp_path: Path) -> None:
    made = read_ies(written(tmp_path, ies()))
    assert str(made.opening) == "rectangle, 0.25 x 0.5 x 0 m"
    assert made.at(np.array([0, 22.5, 45, 90, 91]), np.array([0, 10, 370, -20, 0])) == pytest.approx(
        [1000, 750, 500, 0, 0]
    )
    x = np.radians(np.linspace(0, 90, 20_001))
    middle = (x[1:] + x[:-1]) / 2
    flux = 2 * np.pi * (made.at(np.degrees(middle), 0 * middle) * np.sin(middle) * np.diff(x)).sum()
    assert made.lumens == pytest.approx(flux, rel=1e-6)


def test_an_even_lamp_of_1000_cd_has_4000_pi_lm(tmp_path: Path) -> None:
    even = read_ies(written(tmp_path, ies("0 90 180", candela="1000 1000 1000")))
    assert even.lumens == pytest.approx(4000 * np.pi)


@pytest.mark.parametrize("year", HEADS)
def test_factors(tmp_path: Path, year: int) -> None:
    """Ballast-lamp factors count up to 1991; their place is left free later."""
    text = ies(head=HEADS[year], numbers="1 800 2", factors=".9 .5 50", units=1)
    made = read_ies(written(tmp_path, text))
    assert made.at(np.array(0.0), np.array(0.0)) == pytest.approx(1000 * 2 * 0.9 * (0.5 if year < 1995 else 1))
    assert made.opening.size_m[1] == pytest.approx(0.5 * 0.3048)


@pytest.mark.parametrize(
    ("horizontal", "values", "asked", "expected"),
    [
        ("0 90", "1 2", (0, 45, 90, 135, 180, 225, 270, 315), (1, 1.5, 2, 1.5, 1, 1.5, 2, 1.5)),
        ("0 90 180", "1 2 5", (0, 45, 135, 180, 225, 270, 315), (1, 1.5, 3.5, 5, 3.5, 2, 1.5)),
        ("90 180 270", "1 2 5", (90, 135, 180, 0, 45, 270, 315), (1, 1.5, 2, 2, 1.5, 5, 3.5)),
        ("90 270", "1 5", (90, 180, 0, 270), (1, 3, 3, 5)),
        ("0 90 180 270 360", "1 2 5 4 1", (45, 225, 315), (1.5, 4.5, 2.5)),
        ("0 90 180 270", "1 2 5 4", (45, 225, 315, 360), (1.5, 4.5, 2.5, 1)),
    ],
)
def test_symmetries(tmp_path: Path, horizontal: str, values: str, asked: tuple, expected: tuple) -> None:
    candela = "\n".join(f"{value} 0" for value in values.split())
    made = read_ies(written(tmp_path, ies("0 90", horizontal, candela)))
    assert (made.horizontal_deg[0], made.horizontal_deg[-1]) == (0, 360) and (np.diff(made.horizontal_deg) > 0).all()
    assert made.at(np.zeros(len(asked)), np.array(asked, float)) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("horizontal", "words"),
    [
        ("0", "about the axis"), ("0 90", "to both planes"), ("0 180", "to C0-C180"), ("90 270", "to C90-C270"),
        ("0 180 360", "none"),
    ],
)  # fmt: skip
def test_symmetries_in_words(tmp_path: Path, horizontal: str, words: str) -> None:
    candela = "1 0\n" * len(horizontal.split())
    assert read_luminaire(written(tmp_path, ies("0 90", horizontal, candela))).symmetry == words


def test_keywords_and_separators(tmp_path: Path) -> None:
    """A keyword may be empty; commas separate too; text after the data is ignored."""
    text = ies().replace("[MANUFAC] none", "[MANUFAC]\n[LUMCAT]  D 1 \n[LUMINAIRE]\n[LAMP] LED [3000 K]\n[MORE] x")
    made = read_luminaire(written(tmp_path, text.replace("1000 500 0", "1000,500, 0\r\nEND 7")))
    assert (made.maker, made.name, made.report, made.sets[0].kind) == ("", "D 1", "by hand", "LED [3000 K]")
    assert made.values.candela[0] == (1000, 500, 0)
    relative = read_luminaire(written(tmp_path, ies(numbers="2 800 1", factors="1 1 36")))
    assert (relative.absolute, relative.sets[0].count, relative.sets[0].lumens, relative.sets[0].watts) == (
        False, 2, 1600, 36,
    )  # fmt: skip
    assert made.absolute and made.sets[0].lumens == 0


def test_tilt(tmp_path: Path) -> None:
    for geometry, factors in ((1, (1.0, 0.9, 0.8)), (2, (1.0, 1.0, 1.0))):
        made = read_ies(written(tmp_path, ies(tilt=f"TILT=INCLUDE\n{geometry}\n3\n0 45 90\n1 .9 .8")))
        assert [made.tilted(deg) for deg in (0.0, 45.0, 90.0)] == pytest.approx(factors)
    assert made.at(np.array(0.0), np.array(0.0)) == 1000


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "is not an IES or EULUMDAT file"),
        ("TILT=NONE\n", "truncated"),
        (ies(kind=4), "photometric type: is unknown"),
        (ies(tilt="TILT=lamp.tlt"), "tilt file is missing; found lamp.tlt"),
        (ies(tilt="TILT=../../lamp.tlt"), "TILT: path leaves its folder"),
        (ies(candela="1000 500"), "candela: file is truncated"),
        (ies(candela="1000 nan 0"), "not finite"),
        (ies("0 90 45"), "do not increase"),
        (ies("-90 0 90"), "outside 0 to 180"),
        (ies("0 90", "0 70", "1 1 1 1"), "found 0 to 70; expected 0 to 0, 90, 180 or 360, or 90 to 270"),
        (ies("0 90", "10 80", "1 1 1 1"), "unsupported range"),
        (ies("0", "0", "1"), "vertical angles: are too few for a distribution; found 1; expected 2 or more"),
        (ies("-90 0 90", "0", "0 1 0", kind=2), "horizontal angles: are too few"),
        (ies(candela="1e30 0 0"), "intensities: are out of range; found 1e.30; expected up to 1e.12"),
        (ies("0 45 91", kind=2), "outside -90 to 90"),
        (ies("0 90", "0 120", "1 1 1 1", kind=3), "outside -90 to 90"),
        (ies().replace("3 1 1 2", "3000000 1 1 2"), "at most 4096 angles"),
        (ies().replace("3 1 1 2", "3.5 1 1 2"), "whole number"),
    ],
)
def test_what_is_refused(tmp_path: Path, text: str, word: str) -> None:
    with pytest.raises(UserError, match=word) as caught:
        read_ies(written(tmp_path, text))
    assert "\n" not in str(caught.value) and "cannot be read as" not in str(caught.value)


ROUND = "\n".join(
    ("500 400 300 100 0", "500 300 200 50 0", "500 450 350 120 0", "500 200 100 20 0", "500 400 300 100 0")
)


def radiance_lx(path: Path, places: np.ndarray) -> np.ndarray:
    """Illuminance by ies2rad and rtrace on upward places (n, 2) x, z that lie 2 m below; Radiance's up is z."""
    found = importlib.util.find_spec("pyradiance")
    if found is None:
        pytest.skip("pyradiance is not installed")
    package, folder = Path(str(found.origin)).parent, path.parent
    library = {"PATH": f"{package / 'bin'}:/usr/bin:/bin", "RAYPATH": f".:{package / 'lib'}"}

    def run(*command: str, given: str = "") -> str:
        told = {"input": given, "capture_output": True, "text": True, "check": True}
        return str(subprocess.run(command, cwd=folder, env=library, **told).stdout)  # type: ignore[call-overload]

    run("ies2rad", "-t", "default", "-dm", "-o", "lamp", path.name)
    (folder / "scene.rad").write_text(run("xform", "-t", "0", "0", "2", "lamp.rad"))
    with open(folder / "scene.oct", "wb") as octree:
        subprocess.run(["oconv", "scene.rad"], cwd=folder, env=library, stdout=octree, check=True)
    given = "".join(f"{x} {-z} 0 0 0 1\n" for x, z in places)
    answer = run("rtrace", "-I", "-h", "-ab", "0", "-dc", "1", "-dt", "0", "-ds", ".01", "scene.oct", given=given)
    return np.asarray(179 * np.array([line.split() for line in answer.splitlines()], float)[:, 1])


def lx(path: Path, places: np.ndarray) -> np.ndarray:
    """The same by the inverse square and the cosine."""
    lamp = IesLight((0.0, 2.0, 0.0), read_ies(path), (1.0, 1.0, 1.0))
    to = np.stack([places[:, 0], 0 * places[:, 0] - 2, places[:, 1]], axis=1)
    metres = np.linalg.norm(to, axis=1)
    a, b, down = ((to / metres[:, None]) @ axis for axis in lamp.axes)
    return 2 * lamp.photometry.at(np.degrees(np.arccos(down)), np.degrees(np.arctan2(b, a))) / metres**3


def test_radiance_sees_the_same_luminaire(tmp_path: Path) -> None:
    """All the way round, with multiplier and ballast factor."""
    text = ies("0 20 40 60 90", "0 90 180 270 360", ROUND, head=HEADS[1995], numbers="1 -1 2", factors=".9 1 50")
    path = written(tmp_path, text.replace(" .5 .25 0\n", " .01 .01 0\n"))
    places = np.random.default_rng(0).uniform(-2, 2, (40, 2))
    np.testing.assert_allclose(radiance_lx(path, places), lx(path, places), rtol=2e-3, atol=0.01)


def test_radiance_sees_the_same_floodlight_of_type_b(tmp_path: Path) -> None:
    """Uneven up and down, left and right. In the two planes through its axis, where source.cal follows the standard."""
    angles = np.arange(-90, 91, 10)
    h, v = np.meshgrid(angles, angles, indexing="ij")
    candela = np.round(1000 + 5 * h + 3 * v).astype(int)
    words = " ".join(map(str, angles))
    text = ies(words, words, "\n".join(" ".join(map(str, row)) for row in candela), head=HEADS[1995], kind=2)
    path = written(tmp_path, text.replace(" .5 .25 0\n", " .01 .01 0\n"))
    along = np.linspace(-2, 2, 17)
    places = np.concatenate([np.stack([along, 0 * along], axis=1), np.stack([0 * along, along], axis=1)])
    found = lx(path, places)
    assert np.ptp(found[[0, 16, 17, 33]]) > 10, "the ends of both planes differ"
    np.testing.assert_allclose(radiance_lx(path, places), found, rtol=5e-3)


FINE = [*range(0, 20), *range(20, 91, 5)]
BOTH = sorted({*FINE, *(-deg for deg in FINE)})


def read(folder: Path, text: str) -> Luminaire:
    return read_luminaire(written(folder, text))


@pytest.mark.parametrize(
    ("kind", "up", "right", "up_then_right"),
    [(3, (30, 0), (30, 270), (60, 0)), (2, (30, 0), (30, 270), (60, 270))],
)
def test_where_the_angles_lead(
    tmp_path: Path, kind: int, up: tuple[int, int], right: tuple[int, int], up_then_right: tuple[int, int]
) -> None:
    """V = 30 and H = 30 from the axis; at V = 60 of type A, and at H = 60 of type B, the other angle is 0."""
    angles = (-90, -60, -30, 0, 30, 60, 90)
    h, v = np.meshgrid(angles, angles, indexing="ij")
    for peak, (gamma, c) in (((0, 30), up), ((30, 0), right), ((0, 60) if kind == 3 else (60, 0), up_then_right)):
        candela = "\n".join(" ".join(map(str, row)) for row in 100 * ((h == peak[0]) & (v == peak[1])))
        words = " ".join(map(str, angles))
        made = read(tmp_path, ies(words, words, candela, kind=kind)).values
        assert made.at(np.array([gamma]), np.array([c])) == pytest.approx([100], abs=0.5)
        assert np.max(made.candela) == pytest.approx(100, abs=0.5)


@pytest.mark.parametrize("kind", ["A", "B"])
def test_an_oblique_direction(tmp_path: Path, kind: str) -> None:
    """45 degrees of both angles: in type A, V lifts by sin 45 out of the plane that H turned; in type B the reverse."""
    light: Light = lambda x, y, z: 100 + 50 * x - 30 * y  # noqa: E731
    made = read(tmp_path, ies_of(light, kind, BOTH, BOTH)).values
    half, root = 0.5, np.sqrt(0.5)
    x, y, z = (root, -half, half) if kind == "A" else (half, -root, half)
    gamma, c = np.degrees(np.arccos(z)), np.degrees(np.arctan2(y, x))
    assert made.at(np.array([gamma]), np.array([c])) == pytest.approx([100 + 50 * x - 30 * y], rel=2e-3)


@pytest.mark.parametrize("exponent", [1, 6, 60])
def test_one_luminaire_in_all_types(tmp_path: Path, exponent: float) -> None:
    """Intensity and flux of I0 cos^n by every format and symmetry; flux 2 pi I0 / (n + 1)."""
    light = lobe(exponent)
    fine, gamma = [*np.arange(0, 20.1, 0.5), *range(22, 91, 2)], np.arange(0, 90.1, 0.5)
    sides = sorted({*fine, *(-deg for deg in fine)})
    made = {
        "C": ies_of(light, "C", [0], fine), "C all round": ies_of(light, "C", [0, 90, 180, 270, 360], fine),
        "A": ies_of(light, "A", sides, sides), "A, left to right": ies_of(light, "A", fine, sides),
        "B": ies_of(light, "B", sides, sides), "B, left to right": ies_of(light, "B", fine, sides),
        "B, a quarter": ies_of(light, "B", fine, fine),
        "EULUMDAT": ldt_of(light, [0], fine, 1), "EULUMDAT all round": ldt_of(light, range(0, 360, 30), fine),
    }  # fmt: skip
    lumens = 2 * np.pi * 1000 / (exponent + 1)
    for name, text in made.items():
        one = read(tmp_path, text)
        values = one.values.at(gamma, 37 * gamma)
        expected = 1000 * np.cos(np.radians(gamma)) ** exponent
        np.testing.assert_allclose(values, expected, atol=5, err_msg=name)
        assert one.values.lumens == pytest.approx(lumens, rel=5e-3), name


@pytest.mark.parametrize("kind", ["A", "B"])
def test_uneven_light_agrees_at_the_files_own_angles(tmp_path: Path, kind: str) -> None:
    """A lobe that leans, sampled as coarsely as files are; within half a per cent of the peak, and of the flux."""
    aim = np.array([0.3, -0.2, 0.933])

    def leaning(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        return 1000 * np.maximum(aim[0] * x + aim[1] * y + aim[2] * z, 0) ** 30

    angles = list(range(-90, 91, 5))
    made = read(tmp_path, ies_of(leaning, kind, angles, angles)).values
    h, v = np.meshgrid(np.radians(angles), np.radians(angles), indexing="ij")
    lift, turn = (v, h) if kind == "A" else (h, v)
    along, across, ahead = np.sin(lift), np.cos(lift) * np.sin(turn), np.cos(lift) * np.cos(turn)
    x, y, z = (along, -across, ahead) if kind == "A" else (across, -along, ahead)
    found = made.at(np.degrees(np.arccos(np.clip(z, -1, 1))), np.degrees(np.arctan2(y, x)))
    assert np.abs(found - leaning(x, y, z)).max() < 5
    own = Photometry.of(np.arange(0, 181, 5.0), np.arange(90, 271, 5.0), _planes_first(leaning(x, y, z), kind)[:, ::-1])
    assert made.lumens == pytest.approx(own.lumens, rel=5e-3)


def test_broad_light_needs_no_fine_grid(tmp_path: Path) -> None:
    made = read(tmp_path, ies_of(lobe(1), "B", BOTH, BOTH)).values
    assert (len(made.vertical_deg), len(made.horizontal_deg)) == (len(FINE), 73)


def _planes_first(candela: np.ndarray, kind: str) -> np.ndarray:
    return candela if kind == "A" else candela.T


def test_openings_follow_the_axis(tmp_path: Path) -> None:
    """A headlamp's disc, which faces photometric horizontal, faces its axis."""
    text = ies_of(lobe(3), "A", BOTH, BOTH).replace(" .5 .25 0\n", " -.1 0 -.1\n")
    assert text.startswith(HEADS[2002])
    assert str(read(tmp_path, text).values.opening) == "disc, 0.1 x 0.1 x 0 m"
