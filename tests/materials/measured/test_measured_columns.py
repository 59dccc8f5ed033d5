"""Plain columns and ASTM E1392: names of columns, units, scattered directions, and the refusal to guess."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import angles, direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.measured import load
from tests.materials.measured.measured_files import GLOSSY, Loaded

# of linear Rec. 709 (IEC 61966-2-1)
D65_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
GRID = np.array(
    [(a, 0, b, c) for a in (0, 30, 60) for b in (0, 20, 40, 60) for c in (0, 60, 120, 180, 240, 300)], float
)


def table_text(names: str, rows: np.ndarray, separator: str = " ") -> str:
    return names + "\n" + "\n".join(separator.join(f"{value:.9g}" for value in row) for row in rows) + "\n"


def f_of(grid_deg: np.ndarray) -> np.ndarray:
    wi, wo = direction(*np.radians(grid_deg[:, :2].T)), direction(*np.radians(grid_deg[:, 2:].T))
    return MaterialBSDF(GLOSSY).eval(wi, wo)


@pytest.mark.parametrize(
    ("names", "separator", "scale"),
    [
        ("theta_i phi_i theta_o phi_o BRDF", " ", 1),
        ("# theta_in phi_in theta_out phi_out brdf", "\t", 1),
        ("Theta_l,Phi_l,Theta_v,Phi_v,fr", ",", 1),
        ("theta-i (rad); phi-i (rad); theta-s (rad); phi-s (rad); BSDF [1/sr]", ";", np.pi / 180),
    ],
)
def test_names_separators_and_units(loaded: Loaded, names: str, separator: str, scale: float) -> None:
    table = loaded(
        "% made up\n" * names.startswith("#")
        + table_text(names, np.column_stack([GRID * scale, f_of(GRID)[:, 0]]), separator)
    )
    samples = table.samples()
    assert table.info.format == "gonio text" and len(samples) == len(GRID)
    np.testing.assert_allclose(samples.f, MaterialBSDF(GLOSSY).eval(samples.wi, samples.wo)[:, :1], rtol=1e-6)


@pytest.mark.parametrize(("name", "power"), [("brdf_cos", 1), ("CCBRDF", 1), ("transfer", 1), ("btdf", 0)])
def test_the_name_gives_the_quantity(loaded: Loaded, name: str, power: int) -> None:
    samples = loaded(
        table_text(f"theta_in phi_in theta_out phi_out {name}", np.column_stack([GRID, 0 * GRID[:, 0] + 1]))
    ).samples()
    np.testing.assert_allclose(samples.f[:, 0], samples.wo[:, 2] ** -power, rtol=1e-9)


def test_colour_and_spectra(loaded: Loaded) -> None:
    rgb = f_of(GRID)
    for names in ("brdf_r brdf_g brdf_b", "450nm 550nm 650nm"):
        samples = loaded(
            table_text(
                f"VARS theta_i,phi_i,theta_s,phi_s,{','.join(names.split())}",
                np.column_stack([GRID, rgb if "r" in names else 0 * rgb + 0.25]),
                ",",
            )
        ).samples()
        expected = MaterialBSDF(GLOSSY).eval(samples.wi, samples.wo) if "r" in names else 0.25
        np.testing.assert_allclose(samples.f, np.broadcast_to(expected, samples.f.shape), rtol=1e-6)


@pytest.mark.parametrize(("names", "matrix"), [("bsdf_X bsdf_Y bsdf_Z", D65_XYZ), ("brdf_r brdf_g brdf_b", np.eye(3))])
def test_colours_below_the_angles_of_gonio_text(tmp_path: Path, names: str, matrix: np.ndarray) -> None:
    """Other names of the quantity than that format's, or X, Y and Z, which become linear RGB."""
    rgb = f_of(GRID)
    text = table_text(f"theta_i phi_i theta_o phi_o {names}", np.column_stack([GRID, rgb @ matrix.T]))
    (tmp_path / "a").write_text(text)
    samples = load(tmp_path / "a").samples()
    np.testing.assert_allclose(samples.f, MaterialBSDF(GLOSSY).eval(samples.wi, samples.wo), rtol=1e-3)


def test_a_scan_in_the_plane_needs_no_phi(loaded: Loaded) -> None:
    """Positive theta_o lies ahead of the normal, in the mirror direction."""
    theta = np.arange(-75, 76, 5)
    rows = np.column_stack([np.full(len(theta), 30), theta, np.exp(-(((theta - 30) / 20) ** 2))])
    table = loaded(table_text("theta_i theta_o brdf", rows))
    wi = direction(np.radians(30), 0.0)
    assert table.eval(wi, wi * (-1, 1, 1))[0] == pytest.approx(1, rel=1e-6)
    assert table.eval(wi, wi)[0] == pytest.approx(np.exp(-9), rel=1e-3)


def astm_text(rows: np.ndarray, variables: str = "theta_i,phi_i,theta_s,phi_s,R,G,B") -> str:
    return table_text(f'LAB_NAME made up\nSAMPLE_NAME "red"\nNUM_POINTS {len(rows)}\nVARS {variables}', rows, ",")


def test_astm_of_a_real_measurement(shared_data: Path, loaded: Loaded) -> None:
    """The Cornell measurement written as tuples comes back unchanged."""
    source = load(shared_data / "measured" / "cornell" / "garnet_red.brdf").samples()
    table = loaded(astm_text(np.column_stack([*angles(source.wi), *angles(source.wo), source.f])))
    samples = table.samples()
    assert table.info.format == "ASTM E1392" and table.name == "red"
    assert any("radians" in note for note in table.info.notes)
    assert len(samples) == len(source) == 1439
    np.testing.assert_allclose(np.sort(samples.f, axis=0), np.sort(source.f, axis=0), rtol=1e-6)
    np.testing.assert_allclose(table.eval(samples.wi, samples.wo), samples.f, rtol=1e-5, atol=1e-7)


def test_astm_degrees_and_the_standards_phi_i(loaded: Loaded) -> None:
    theta = np.arange(0, 80, 5)
    rows = np.array(
        [(40, t, p, np.exp(-((t - 40) ** 2) / 200) * (p == 0) + 0.01) for t in theta for p in (0, 90, 180, 270)]
    )
    table = loaded(astm_text(rows, "theta_i,theta_s,phi_s,BRDF"))
    wi = direction(np.radians(40), np.pi)
    assert table.eval(wi, wi * (-1, 1, 1))[0] == pytest.approx(1.01, rel=1e-6)
    assert any("degrees" in note for note in table.info.notes)
    assert any("phi_i not stated, taken as 180" in note for note in table.info.notes)


def test_scattered_incident_directions(loaded: Loaded, hemisphere: Callable[..., np.ndarray]) -> None:
    wi, wo = hemisphere(300, 1), hemisphere(300, 2)
    table = loaded(astm_text(np.column_stack([*angles(wi), *angles(wo), MaterialBSDF(GLOSSY).eval(wi, wo)])))
    np.testing.assert_allclose(table.eval(wi, wo), MaterialBSDF(GLOSSY).eval(wi, wo), rtol=1e-4)
    assert any("isotropic" in note for note in table.info.notes) and len(table.samples()) == 300


def test_another_encoding_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_text(table_text("theta_in phi_in theta_out phi_out brdf", np.ones((5, 5))), encoding="utf-16")
    with pytest.raises(UserError, match=r"is UTF-16.*save it again as UTF-8"):
        load(path)


ROWS = "0 0 0 0 1\n0 0 20 0 1\n0 0 20 90 1\n"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (ROWS, "is columns without names.*theta_i phi_i theta_o phi_o, then f"),
        (
            "theta_in phi_in theta_out phi_out value\n" + ROWS,
            "quantity of the value columns is not stated; found value",
        ),
        ("theta_in phi_in theta_out phi_out r g b\n0 0 0 0 1 1 1\n", "quantity of the value columns is not stated"),
        ("theta_in phi_in theta_out phi_out a b\n0 0 0 0 1 1\n", "unknown value columns"),
        ("theta_in phi_in theta_out phi_out brdf\n", "no rows"),
        ("theta_in phi_in theta_out phi_out brdf\n0 0 0 0 1\n0 0 0\n", "one value per column name"),
        ("theta_in;phi_in;theta_out;phi_out;brdf\n0,5;0;0;0;0,25\n", "decimal commas"),
        ("0,5;0,0;0,0;0,0;0,25\n0,5;0,0;9,0;0,0;0,25\n", "decimal commas"),
        ("theta_in theta_inc theta_out brdf\n0 0 0 1\n", "same angle"),
        ("theta_in phi_in theta_out phi_out brdf\n99 0 0 0 1\n", "outside its range"),
        ("theta_in phi_in theta_out phi_out brdf\n0 0 0 0 nan\n", "no measured value"),
        ("theta_in phi_in theta_out phi_out brdf\n0 0 0 0 1\n0 0 1.2 3.1 1\n", r"seem to be radians.*add \(rad\)"),
        ("theta_i phi_i theta_o phi_o p\n0 0 200 0 1\n", "outside its range"),
        ("theta_i phi_i theta_o phi_o p\n0 0 0 0 -3\n", "no measured value"),
        ("theta_i phi_i theta_o phi_o p\n0 0 0 0 1\n20 40 0 0 1\n", "do not form a grid"),
        ("# symmetry: isotropc\ntheta_i phi_i theta_o phi_o p\n0 0 0 0 1\n", "did you mean 'isotropic'"),
        ("# symmetry: quadrant\ntheta_i phi_i theta_o phi_o p\n0 0 0 0 1\n0 100 0 0 1\n", "more than the symmetry"),
        ("NUM_POINTS 5\nVARS theta_i,phi_i,theta_s,phi_s,BRDF\n0,0,0,0,1\n", "NUM_POINTS: wrong number of tuples"),
        ("VARS theta_i,phi_i,theta_s,phi_s\n0,0,0,0\n", "unknown value columns; found none"),
    ],
)
def test_refused_columns(loaded: Loaded, text: str, expected: str) -> None:
    with pytest.raises(UserError, match=expected):
        loaded(text)
