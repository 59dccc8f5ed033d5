"""ALTA text: parametrisations against their definitions, quantities, columns of confidence, slices that are refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import angles, direction, half_vector
from lambent.materials.measured import load
from lambent.materials.measured.alta import PARAMETRISATIONS
from tests.materials.measured.measured_files import Loaded, alta_text


def f_of(wi, wo):
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
    table = loaded(alta_text(name, np.stack(columns_of(light, view)[name], axis=-1), f_of(light, view)), "felt.alta")
    assert table.info.format == "ALTA text" and name in table.info.notes[0] and len(table.samples()) > 250
    np.testing.assert_allclose(table.eval(light, view)[:, 0], f_of(light, view), rtol=1e-4)


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
    table = loaded(grid_text("INV_STERADIAN", f_of))
    assert table.info.sizes["theta_i"] == 2 and table.info.isotropic and table.info.channels == 1
    wi, wo = direction(0.8, 0.0), direction(0.9, 0.7)
    np.testing.assert_allclose(table.eval(wi, wo), f_of(wi, wo), rtol=1e-4)


@pytest.mark.parametrize(
    ("out", "stored", "factor"),
    [("INV_STERADIAN", "f", 1.0), ("INV_STERADIAN_COSINE_FACTOR", "f_cos", np.cos(0.9)), ("RGB_COLOR", "f", 1.0)],
)
def test_quantities(loaded: Loaded, out: str, stored: str, factor: float) -> None:
    table = loaded(grid_text(out, lambda wi, wo: np.full((len(wi), 3), (0.3, 0.2, 0.1))))
    assert table.info.stored == stored and table.info.channels == 3
    np.testing.assert_allclose(table.eval(direction(0.8, 0), direction(0.9, 0.7)) * factor, (0.3, 0.2, 0.1), rtol=1e-5)


def test_white_xyz_is_white(loaded: Loaded) -> None:
    np.testing.assert_allclose(
        loaded(grid_text("XYZ_COLOR", lambda wi, wo: np.full((len(wi), 3), (0.95047, 1.0, 1.08883)) * 0.4)).eval(
            direction(0.8, 0), direction(0.9, 0.7)
        ),
        [0.4] * 3,
        rtol=2e-3,
    )


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
    text = grid_text("INV_STERADIAN", f_of)
    dim, name, out = text.split("\n")[1:4]
    body = text.split("\n", 4)[4].replace("\t\n", "\n").replace("\t", ", ")
    content = "\n".join(["mesure du 3 février", "1 2 3", "# gelé", out, name, dim, "#ALTA END HEADER", "", body])
    path = tmp_path / "a.dat"
    path.write_bytes(b"\xef\xbb\xbf" + content.replace("\n", "\r\n").encode("latin-1"))
    wi, wo = direction(0.8, 0.0), direction(0.9, 0.7)
    np.testing.assert_allclose(load(path).eval(wi, wo), f_of(wi, wo), rtol=1e-4)


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


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("#DIM 1 3\n#PARAM_IN COS_TH\n#PARAM_OUT RGB_COLOR\n0.9 .1 .2 .3\n", "slice.*COS_TH.*half vector alone"),
        ("#DIM 1 1\n#PARAM_IN COS_TLR\n#PARAM_OUT INV_STERADIAN\n0.9 .1\n", "slice.*mirrored view alone"),
        ("#DIM 1 1\n0.5 2.5\n", "curve over one variable"),
        ("#PARAM_IN UNKNOWN_PARAMETRIZATION \n#DIM 1 1 \n#VS 2 \n 0.1 1 .5 1.5\n", "curve over one variable"),
        ("#ALTA FUNC HEADER\n#DIM 3 3\n#PARAM_IN COS_TH\n#ALTA HEADER END\n\n#FUNC lafortune\n1 2\n", "fitted by ALTA"),
        ("#DIM 3 1\n#PARAM_OUT RGB_COLOR\n0 0 0 1\n", "PARAM_IN: is unknown; found nothing.*STARK_3D"),
        ("#DIM 3 1\n#PARAM_IN RUSIN_TH_TP_PD\n#PARAM_OUT RGB_COLOR\n0 0 0 1\n", "did you mean 'RUSIN_TH_TD_PD'"),
        ("#DIM 4 1\n#PARAM_IN RUSIN_TH_TD_PD\n#PARAM_OUT INV_STERADIAN\n0 0 0 0 1\n", "#DIM: .*expected 3 for"),
        ("#DIM 3 1\n#PARAM_IN RUSIN_TH_TD_PD\n0 0 0 1\n", "PARAM_OUT: quantity.*is not stated.*INV_STERADIAN"),
        ("#DIM 3 7\n#PARAM_IN RUSIN_TH_TD_PD\n#PARAM_OUT INV_STERADIAN\n" + "0 " * 10, "wavelengths"),
        ("#DIM 3 1\n#PARAM_IN RUSIN_TH_TD_PD\n#PARAM_OUT INV_STERADIAN\n0 0 0 1 2\n", "wrong number of columns"),
        ("#DIM 3 1\n#PARAM_IN RUSIN_TH_TD_PD\n#PARAM_OUT INV_STERADIAN\n30 20 90 1\n", "more than a turn.*radians"),
        ("#DIM 3 1\n#PARAM_IN RUSIN_TH_TD_PD\n#PARAM_OUT INV_STERADIAN\n1.5 1.5 3 1\n", "above the horizon"),
    ],
)  # fmt: skip
def test_refusals_say_what_the_file_is(loaded: Loaded, text: str, said: str) -> None:
    with pytest.raises(UserError, match=said):
        loaded(text)
