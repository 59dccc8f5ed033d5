"""Homomorphic factors: recognised by content, the product of their textures, and errors that name what is missing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.factored.opening import editable_of
from lambent.materials.measured.homomorphic import recognise
from lambent.materials.measured.registry import load

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
