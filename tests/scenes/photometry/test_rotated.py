"""Photometry of types A and B: where its angles lead, and the same luminaire in all three types."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.scenes.photometry.distribution import Photometry
from lambent.scenes.photometry.files import read_luminaire
from lambent.scenes.photometry.luminaire import Luminaire
from tests.scenes.photometry.test_ies import HEADS, ies, written
from tests.scenes.photometry.written_files import Light, ies_of, ldt_of, lobe

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
