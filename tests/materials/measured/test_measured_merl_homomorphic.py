"""MERL's bins, scales, holes and weights; homomorphic factors, the product of their textures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.factored.opening import editable_of
from lambent.materials.measured import load
from lambent.materials.measured.homomorphic import recognise
from lambent.materials.measured.merl import directions_of, half_difference_angles
from tests.materials.measured.measured_files import Loaded, merl_bytes

ALPHA = "0.5\n.25\n1e-1\n"
FULL = "Velvet, No. 3\n{kind}\n0.5 .25 1e-1\n19.69\n\n"


def picture(path: Path, value: np.ndarray) -> None:
    Image.fromarray(np.round(255 * np.clip(value, 0, 1)).astype(np.uint8)).save(path)


def parabolic(n: int = 64) -> tuple[np.ndarray, np.ndarray]:
    """theta and phi (n, n) of a map's texels."""
    x = (np.arange(n) + 0.5) * (2 / n) - 1
    return 2 * np.arctan(np.hypot(x[:, None], x)), np.arctan2(x[:, None], x)


def factors(folder: Path, names: tuple[str, str] = ("velvetp.png", "velvetq.png"), uneven: float = 0.0) -> None:
    theta, phi = parabolic()
    p = (0.4 + 0.3 * np.sin(np.minimum(theta, np.pi / 2))) * (1 + uneven * np.cos(2 * phi))
    q = 0.1 + 0.8 * np.exp(-((theta / 0.4) ** 2))
    picture(folder / names[0], np.stack([p, p, 0.5 * p], axis=-1))
    picture(folder / names[1], np.stack([q, 0 * q, q], axis=-1))


def test_the_product_of_the_textures(tmp_path: Path) -> None:
    factors(tmp_path)
    (tmp_path / "alpha").write_text(ALPHA)
    table = load(tmp_path / "alpha")
    assert table.info.format == "homomorphic factors"
    assert table.info.isotropic
    theta_i, theta_o = np.radians([10.0, 40, 70]), np.radians([30.0, 40, 20])
    wi, wo = direction(theta_i, np.pi), direction(theta_o, 0.0)
    theta_h = np.abs(theta_i - theta_o) / 2
    p_i, p_o = (0.4 + 0.3 * np.sin(theta) for theta in (theta_i, theta_o))
    q = 0.1 + 0.8 * np.exp(-((theta_h / 0.4) ** 2))
    expected = np.stack([0.5 * p_i * p_o * q, 0 * q, 0.1 * 0.25 * p_i * p_o * q], axis=-1)
    assert np.allclose(table.eval(wi, wo), expected, rtol=0.03, atol=1e-6)
    assert not table.eval(wi * [1, 1, -1], wo).any()


@pytest.mark.parametrize(
    ("kind", "names"), [(0, ("velvet_0.png", "velvet_1.png")), (1, ("velvetp.png", "velvetq.png"))]
)
def test_a_titled_file_names_its_textures(tmp_path: Path, kind: int, names: tuple[str, str]) -> None:
    factors(tmp_path, names)
    (tmp_path / "velvet.txt").write_bytes(FULL.format(kind=kind).replace("\n", "\r\n").encode())
    table = load(tmp_path / "velvet.txt")
    assert table.samples(500).f[:, 0].min() > 0
    assert any("highlight" in note for note in table.info.notes) == (kind == 1)


@pytest.mark.parametrize("uneven", [0.0, 0.2])
def test_curves_and_quotient_are_the_textures(tmp_path: Path, uneven: float) -> None:
    factors(tmp_path, uneven=uneven)
    (tmp_path / "alpha").write_text(ALPHA)
    opened = editable_of(tmp_path / "alpha")
    assert load(tmp_path / "alpha").info.isotropic == (uneven == 0)
    assert set(opened.editable.curves) == {"P", "Q"}
    (term,) = opened.editable.terms
    assert term.viewer == "P"
    assert opened.errors["l1"] < 1e-3
    assert (opened.without_quotient["l1"] > 0.02) == (uneven > 0)
    p = opened.editable.curves["P"].at(np.radians([5.0, 30, 60]))[:, 0]
    assert np.allclose(p, 0.4 + 0.3 * np.sin(np.radians([5.0, 30, 60])), atol=0.01)


BROKEN = {
    "textures P and Q; found 0 pairs": ("alpha", ALPHA, ()),
    "textures P and Q; found 2 pairs": ("alpha", ALPHA, (("ap.png", "aq.png"), ("bp.png", "bq.png"))),
    "texture P is missing; expected velvet_0.png or velvetp.png": ("velvet.txt", FULL.format(kind=0), ()),
    "line 2.*highlight alone": ("velvet.txt", FULL.format(kind=2), (("velvetp.png", "velvetq.png"),)),
    "alpha is negative": ("alpha", "1\n-2\n3\n", (("ap.png", "aq.png"),)),
}


@pytest.mark.parametrize("said", BROKEN)
def test_errors_name_what_is_missing(tmp_path: Path, said: str) -> None:
    name, text, textures = BROKEN[said]
    (tmp_path / name).write_text(text)
    for names in textures:
        factors(tmp_path, names)
    with pytest.raises(UserError, match=said):
        load(tmp_path / name)


def test_a_picture_that_is_no_map_is_refused(tmp_path: Path) -> None:
    factors(tmp_path)
    picture(tmp_path / "velvetq.png", np.ones((32, 64, 3)))
    (tmp_path / "alpha").write_text(ALPHA)
    with pytest.raises(UserError, match=r"velvetq\.png: is not a parabolic map; found 64x32"):
        load(tmp_path / "alpha")
    (tmp_path / "velvetq.png").write_bytes(b"no picture")
    with pytest.raises(UserError, match=r"velvetq\.png"):
        load(tmp_path / "alpha")


@pytest.mark.parametrize(
    "text", ["1\n2\n", "1 2 3\n", "1\n2\n3\n4\n", "1\n2\nx\n", "title\n3\n1 2 3\n4\n", "title\n0\n1 2\n4\n"]
)
def test_other_texts_are_left_to_other_readers(text: str) -> None:
    assert not recognise(text.encode(), len(text))


SHAPE = (30, 20, 24)


def _saved(path: Path, f: np.ndarray) -> Path:
    path.write_bytes(merl_bytes(f))
    return path


def _centres() -> tuple[np.ndarray, ...]:
    i, j, k = np.meshgrid(*map(np.arange, SHAPE), indexing="ij")
    return ((i + 0.5) / 30) ** 2 * np.pi / 2, (j + 0.5) / 20 * np.pi / 2, (k + 0.5) / 24 * np.pi


def test_values_stand_at_bin_centres(tmp_path: Path) -> None:
    f = np.random.default_rng(0).uniform(0.1, 2, (*SHAPE, 3))
    table = load(_saved(tmp_path / "a", f))
    wi, wo = directions_of(*_centres())
    seen = (wi[..., 2] > 0.01) & (wo[..., 2] > 0.01)
    np.testing.assert_allclose(table.eval(wi, wo)[seen], f[seen], rtol=1e-5)


def test_the_last_bin_of_phi_d_is_followed_by_the_first(tmp_path: Path) -> None:
    """phi_d and phi_d + pi are one pair of directions, exchanged: at 0 f lies between the last bin and the first."""
    f = np.random.default_rng(2).uniform(0.1, 2, (*SHAPE, 3))
    table = load(_saved(tmp_path / "a", f))
    theta_h, theta_d, _ = (grid[4:8, 3:6, 0] for grid in _centres())
    wi, wo = directions_of(theta_h, theta_d, np.full(theta_h.shape, 1e-9))
    np.testing.assert_allclose(table.eval(wi, wo), f[4:8, 3:6, [0, -1]].mean(axis=2), rtol=1e-5)


def test_angles_round_trip_and_reciprocity(hemisphere, tmp_path: Path) -> None:
    theta_h, theta_d, phi_d = (a.ravel() for a in _centres())
    for value, expected in zip(
        half_difference_angles(*directions_of(theta_h, theta_d, phi_d)), (theta_h, theta_d, phi_d), strict=True
    ):
        np.testing.assert_allclose(value, expected, atol=1e-7)
    f = np.random.default_rng(1).uniform(0, 1, (*SHAPE, 3))
    table = load(_saved(tmp_path / "a", f))
    wi, wo = hemisphere(500, 3), hemisphere(500, 4)
    np.testing.assert_allclose(table.eval(wi, wo), table.eval(wo, wi), rtol=1e-4)


def test_white_lambert_has_albedo_one(tmp_path: Path) -> None:
    table = load(_saved(tmp_path / "a", np.full((*SHAPE, 3), 1 / np.pi)))
    wi = np.array([[0, 0, 1], [0.6, 0, 0.8], [0.96, 0, 0.28]])
    np.testing.assert_allclose(table.albedo(wi), 1, rtol=5e-3)
    cap = 2 * np.pi * (1 - np.cos(np.radians(84)))  # solid angle of the directions that are not grazing
    assert table.samples().weight.sum() == pytest.approx(cap**2, rel=0.02)


def test_holes_in_any_channel_are_counted_and_filled(loaded: Loaded) -> None:
    f = np.full((*SHAPE, 3), 0.5)
    f[3, 4, 5, 1] = np.nan
    raw = bytearray(merl_bytes(f))
    raw[12 + 8 * 7 : 12 + 8 * 8] = np.array([np.nan]).tobytes()
    table = loaded(raw)
    left_out = table.samples().left_out
    assert (left_out.shadowed, left_out.not_finite) == (1, 1)
    wi, wo = directions_of(*(a[3, 4, 5] for a in _centres()))
    np.testing.assert_allclose(table.eval(wi, wo), 0.5, rtol=1e-5)
