"""Plain columns, ASTM E1392, Cornell and ALTA text: names, units, spectra, parametrisations; no guesses."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lambent.core.geometry.directions import angles, direction, half_vector
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.measured import load
from lambent.materials.measured.alta import PARAMETRISATIONS
from lambent.materials.measured.parts.spectral import rgb_of_spectra
from tests.materials.measured.measured_files import GLOSSY, Loaded, alta_text, cornell_rows, cornell_text

BANDS_NM = np.linspace(400, 700, 31)


def test_flat_spectrum_is_grey() -> None:
    np.testing.assert_allclose(rgb_of_spectra(BANDS_NM) @ np.full(31, 0.37), 0.37, rtol=1e-12)


def test_spectra_agree_with_colour_science() -> None:
    """A smooth reddish reflectance, against the reference's own integration."""
    import colour

    values = 0.1 + 0.8 / (1 + np.exp(-(BANDS_NM - 590) / 20))
    shape = colour.SpectralShape(360, 780, 5)
    sd = colour.SpectralDistribution(dict(zip(BANDS_NM, values, strict=True)))
    sd = sd.extrapolate(shape).interpolate(colour.SpectralShape(360, 780, 1), colour.LinearInterpolator)
    with colour.utilities.suppress_warnings(colour_runtime_warnings=True):
        xyz = colour.sd_to_XYZ(sd, illuminant=colour.SDS_ILLUMINANTS["D65"], method="Integration") / 100
    expected = colour.RGB_COLOURSPACES["ITU-R BT.709"].matrix_XYZ_to_RGB @ xyz
    np.testing.assert_allclose(rgb_of_spectra(BANDS_NM) @ values, expected, atol=2e-3)


@pytest.mark.parametrize("name", ["garnet_red", "krylon_blue"])
def test_real_files(shared_data: Path, name: str) -> None:
    table = load(shared_data / "measured" / "cornell" / f"{name}.brdf")
    samples = table.samples()
    assert len(samples) == 1439 and samples.left_out.total == 0
    np.testing.assert_allclose(table.eval(samples.wi, samples.wo), samples.f, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(samples.weight.sum(), (2 * np.pi) ** 2, rtol=1e-9)
    r, g, b = table.albedo(np.array([0.5, 0.0, np.sqrt(0.75)]))
    assert (r > 2 * max(g, b)) if name == "garnet_red" else (b > 2 * max(r, g))
    assert any("saturated" in note for note in table.info.notes)


def test_bad_samples_are_counted(loaded: Loaded) -> None:
    rows = cornell_rows()
    rows[3, 5], rows[4, 6], rows[5, 6] = np.nan, -0.1, -0.2
    samples = loaded(cornell_text(rows, np.linspace(400, 700, 5))).samples()
    assert (len(samples), samples.left_out.shadowed) == (len(rows) - 1, 1)
    assert (samples.f[[3, 4], 1] < 0.1).all()  # their green reading is below zero
    np.testing.assert_allclose(np.delete(samples.f, [3, 4], axis=0), 0.2, rtol=1e-6)


def sheen(wi, wo):
    """Isotropic and reciprocal: brighter about the mirror direction, and the more, the steeper."""
    return 0.1 + 2 * half_vector(wi, wo)[..., 2] ** 40 + 0.05 * wi[..., 2] * wo[..., 2]


def _turned(v, about_n, about_y):
    """v turned about n, then about y."""
    c, s = np.cos(about_n), np.sin(about_n)
    x, y, z = c * v[:, 0] - s * v[:, 1], s * v[:, 0] + c * v[:, 1], v[:, 2]
    c, s = np.cos(about_y), np.sin(about_y)
    return np.stack([c * x + s * z, y, c * z - s * x], axis=-1)


def columns_of(light: np.ndarray, view: np.ndarray) -> dict[str, tuple[np.ndarray, ...]]:
    """The columns of every parametrisation, from the definitions in ALTA's params.h."""
    half, back = half_vector(light, view), half_vector(view, light * (-1, -1, 1))
    (tl, pl), (tv, pv), (th, ph), (tk, pk) = (angles(w) for w in (light, view, half, back))
    td, pd = angles(_turned(view, -ph, -th))
    h, b = (light + view) / 2, (light - view) / 2
    hp, bp, bn = np.hypot(*h[:, :2].T), np.hypot(*b[:, :2].T), np.linalg.norm(b, axis=1)
    between = np.arctan2(b[:, 1], b[:, 0]) - np.arctan2(h[:, 1], h[:, 0])
    cos_vl = (light * view).sum(axis=1)
    vl = np.arccos(cos_vl)
    x = vl * (view[:, 2] - light[:, 2] * cos_vl) / (np.sin(tl) * np.sin(vl))
    y = vl * np.sin(pl - pv) * np.sin(tv) / np.sin(vl)
    return {
        "RUSIN_TH_TD_PD": (th, td, pd),
        "RUSIN_TH_PH_TD_PD": (th, ph, td, pd),
        "ISOTROPIC_TV_TL_DPHI": (tv, tl, pl - pv),
        "ISOTROPIC_TL_TV_PROJ_DPHI": (tl, tv * np.cos(pl - pv), tv * np.sin(pl - pv)),
        "SPHERICAL_TL_PL_TV_PV": (tl, pl, tv, pv),
        "CARTESIAN": (*view.T, *light.T),
        "STEREOGRAPHIC": (*(view[:, :2].T / (1 + view[:, 2])), *(light[:, :2].T / (1 + light[:, 2]))),
        "SCHLICK_TL_TK_PROJ_DPHI": (tl, tk * np.cos(pl - pk), tk * np.sin(pl - pk)),
        "RETRO_TL_TVL_PROJ_DPHI": (tl, x, y),
        "STARK_3D": (hp, bn, between),
        "NEUMANN_3D": (hp, bp, between),
    }


def pairs(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    return tuple(direction(random.uniform(0.05, 1.3, count), random.uniform(0, 6.28, count)) for _ in range(2))


FULL = [*columns_of(*pairs(2))]


@pytest.mark.parametrize("name", FULL)
def test_parametrisations_are_those_of_alta(name: str) -> None:
    light, view = pairs(500)
    wi, wo = PARAMETRISATIONS[name].directions(np.stack(columns_of(light, view)[name], axis=-1))
    for got, expected in ((wi[:, 2], light[:, 2]), (wo[:, 2], view[:, 2]), ((wi * wo).sum(1), (light * view).sum(1))):
        np.testing.assert_allclose(got, expected, atol=1e-9)


@pytest.mark.parametrize("name", FULL)
def test_files_give_the_values_at_their_own_pairs(loaded: Loaded, name: str) -> None:
    light, view = pairs(300)
    table = loaded(alta_text(name, np.stack(columns_of(light, view)[name], axis=-1), sheen(light, view)), "felt.alta")
    assert table.info.format == "ALTA text" and name in table.info.notes[0] and len(table.samples()) > 250
    np.testing.assert_allclose(table.eval(light, view)[:, 0], sheen(light, view), rtol=1e-4)


def test_known_answers_by_hand(loaded: Loaded) -> None:
    """theta_h = 30 degrees, theta_d = 0: light and view are both at 30 degrees. theta_d alone: they straddle n."""
    rows = [f"{np.radians(30):.9f} 0 0 0.7", f"0 {np.radians(50):.9f} 0 0.3", f"1.2 1.2 {np.pi:.9f} .9"]
    table = loaded("#DIM 3 1\n#PARAM_IN RUSIN_TH_TD_PD\n#PARAM_OUT INV_STERADIAN\n" + "\n".join(rows) + "\n")
    at30, left, right = direction(np.radians([30, 50, 50]), [0.4, 0.4, 0.4 + np.pi])
    assert float(table.eval(at30, at30)[0]) == pytest.approx(0.7, rel=1e-6)
    assert float(table.eval(left, right)[0]) == pytest.approx(0.3, rel=1e-6)
    assert any("1 of 3 pairs are below the horizon" in note for note in table.info.notes)  # 2.4 rad from n


def grid_text(out: str, values, vs: str = "", count: int = 3) -> str:
    tl, tv, dphi = (a.ravel() for a in np.meshgrid([0.2, 0.8], [0.1, 0.5, 0.9, 1.2], np.arange(0, 6.2, 0.7)))
    rows = np.stack([tv, tl, dphi], axis=-1)
    return alta_text("ISOTROPIC_TV_TL_DPHI", rows, values(direction(tl, dphi), direction(tv, 0 * tv)), out, vs)


def test_incident_angles_of_their_own_make_a_gonio_table(loaded: Loaded) -> None:
    table = loaded(grid_text("INV_STERADIAN", sheen))
    assert table.info.sizes["theta_i"] == 2 and table.info.isotropic and table.info.channels == 1
    wi, wo = direction(0.8, 0.0), direction(0.9, 0.7)
    np.testing.assert_allclose(table.eval(wi, wo), sheen(wi, wo), rtol=1e-4)


@pytest.mark.parametrize(
    ("out", "stored", "values", "expected"),
    [
        ("INV_STERADIAN", "f", (0.3, 0.2, 0.1), (0.3, 0.2, 0.1)),
        ("INV_STERADIAN_COSINE_FACTOR", "f_cos", (0.3, 0.2, 0.1), np.array((0.3, 0.2, 0.1)) / np.cos(0.9)),
        ("RGB_COLOR", "f", (0.3, 0.2, 0.1), (0.3, 0.2, 0.1)),
        ("XYZ_COLOR", "f", (0.38019, 0.4, 0.43553), (0.4, 0.4, 0.4)),
    ],
)
def test_quantities(loaded: Loaded, out: str, stored: str, values, expected) -> None:
    table = loaded(grid_text(out, lambda wi, wo: np.full((len(wi), 3), values)))
    assert table.info.stored == stored and table.info.channels == 3
    np.testing.assert_allclose(table.eval(direction(0.8, 0), direction(0.9, 0.7)), expected, rtol=2e-3)


@pytest.mark.parametrize(("vs", "further"), [("0", 0), ("1", 1), ("2", 2), ("1 1 1", 3), ("2 2 2", 6)])
def test_columns_of_confidence_are_not_values(tmp_path: Path, vs: str, further: int) -> None:
    path, count = tmp_path / "a.alta", 3
    path.write_text(
        grid_text(
            "RGB_COLOR", lambda wi, wo: np.hstack([np.full((len(wi), count), 0.3), np.full((len(wi), further), 9)]), vs
        )
    )
    np.testing.assert_allclose(load(path).eval(direction(0.8, 0), direction(0.9, 0.7)), [0.3] * 3, rtol=1e-6)


def test_what_the_next_file_looks_like(tmp_path: Path) -> None:
    """Text above the header, keys in another order, CRLF, a mark of the byte order, Latin-1 comments, commas."""
    text = grid_text("INV_STERADIAN", sheen)
    dim, name, out = text.split("\n")[1:4]
    body = text.split("\n", 4)[4].replace("\t\n", "\n").replace("\t", ", ")
    content = "\n".join(["mesure du 3 février", "1 2 3", "# gelé", out, name, dim, "#ALTA END HEADER", "", body])
    path = tmp_path / "a.dat"
    path.write_bytes(b"\xef\xbb\xbf" + content.replace("\n", "\r\n").encode("latin-1"))
    wi, wo = direction(0.8, 0.0), direction(0.9, 0.7)
    np.testing.assert_allclose(load(path).eval(wi, wo), sheen(wi, wo), rtol=1e-4)


def test_bivariate_tables_hold_at_every_azimuth(loaded: Loaded) -> None:
    th, td = (a.ravel() for a in np.meshgrid(np.radians(np.arange(0, 81, 4)), np.radians(np.arange(0, 81, 4))))
    for name, columns in (("RUSIN_TH_TD", (th, td)), ("COS_TH_TD", (np.cos(th), np.cos(td)))):
        table = loaded(alta_text(name, np.stack(columns, axis=-1), 0.1 + np.cos(th) ** 20))
        assert any("without an azimuth" in note for note in table.info.notes)
        light, view = pairs(200, seed=1)
        expected = 0.1 + half_vector(light, view)[:, 2] ** 20
        np.testing.assert_allclose(
            table.eval(light, view)[:, 0], expected, rtol=0.1, atol=0.02
        )  # no look-up is above its neighbours


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


def test_astm_degrees_and_the_standards_phi_i(loaded: Loaded) -> None:
    theta = np.arange(0, 80, 5)
    rows = np.array(
        [(40, t, p, np.exp(-((t - 40) ** 2) / 200) * (p == 0) + 0.01) for t in theta for p in (0, 90, 180, 270)]
    )
    table = loaded(astm_text(rows, "theta_i,theta_s,phi_s,BRDF"))
    wi = direction(np.radians(40), np.pi)
    assert table.eval(wi, wi * (-1, 1, 1))[0] == pytest.approx(1.01, rel=1e-6)
    assert table.name == "red" and any("degrees" in note for note in table.info.notes)
    assert any("phi_i not stated, taken as 180" in note for note in table.info.notes)


def test_scattered_incident_directions(loaded: Loaded, hemisphere: Callable[..., np.ndarray]) -> None:
    wi, wo = hemisphere(300, 1), hemisphere(300, 2)
    table = loaded(astm_text(np.column_stack([*angles(wi), *angles(wo), MaterialBSDF(GLOSSY).eval(wi, wo)])))
    np.testing.assert_allclose(table.eval(wi, wo), MaterialBSDF(GLOSSY).eval(wi, wo), rtol=1e-4)
    assert table.info.format == "ASTM E1392" and len(table.samples()) == 300
    assert all(any(word in note for note in table.info.notes) for word in ("isotropic", "radians"))
