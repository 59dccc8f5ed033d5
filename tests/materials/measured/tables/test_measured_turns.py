"""Turns and mirrorings of angles in files: the symmetry of the table, and the sign of dphi."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.geometry.directions import direction
from lambent.materials.measured import load
from tests.materials.measured.measured_files import Loaded, zemax_text

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
