"""The edited picture: the direct sum of its terms, curve switching, two materials, no drift."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.editing.picture import EditedPicture, Part, TransportNeeded
from lambent.editing.rows import Rows
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.curve import Curve, angles_rad
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import editable
from lambent.materials.factored.quotients import One
from lambent.materials.factored.terms import Editable, Factor, Term
from lambent.materials.models import model_named
from tests.editing.dense_rows import DensePairs, rows_of

HEIGHT, WIDTH, BANDS = 12, 20, 16


def bands_of(term: Term, pixels: int, seed: int) -> np.ndarray:
    """Transport by bands of each curve of a term, (J, K, 3, P), float64 that half floats nearly hold."""
    counts = [BANDS, BANDS // 2][: len(term.factors)] + [1] * (2 - len(term.factors))
    return np.random.default_rng(seed).random((*counts, 3, pixels)).astype(np.float32)


def part_of(start: Editable, pixel: np.ndarray, seed: int) -> tuple[Part, dict[str, np.ndarray]]:
    rng = np.random.default_rng(seed)
    bands = {term.name: bands_of(term, len(pixel), seed + n) for n, term in enumerate(start.terms)}
    return Part(start, pixel, rng.uniform(0, 1.5, len(pixel)), stored(bands.values())), bands


def stored(bands: Iterable[np.ndarray]) -> tuple[Rows | DensePairs, ...]:
    return tuple(DensePairs(one) if one.shape[1] > 1 else rows_of(one[:, 0]) for one in bands)


def direct(part: Part, bands: dict[str, np.ndarray], material: Editable) -> np.ndarray:
    """(P, 3): the sum that the picture stands for, by bands, from the curves' means."""
    total = np.zeros((len(part.pixel), 3))
    for term in material.terms:
        means = [
            material.curves[f.curve].node_values(n, f.polar)
            for f, n in zip(term.factors, bands[term.name].shape, strict=False)
        ]
        means += [np.ones((1, 3))] * (2 - len(means))
        light = np.einsum("jkcp,jc,kc->pc", bands[term.name].astype(float), *means)
        viewer = material.curves[term.viewer].at(part.theta_o) if term.viewer else 1.0
        total += np.array(term.scale) * viewer * light
    return total


def close(found: np.ndarray, expected: np.ndarray, tolerance: float = 1e-3) -> bool:
    return bool(np.abs(found - expected).max() <= tolerance * np.abs(expected).max())


def pixels_of(image: np.ndarray, part: Part) -> np.ndarray:
    return image.reshape(-1, 3)[part.pixel]


@pytest.fixture
def tray() -> Editable:
    return of_material(Material(name="tray", kd=(0.3, 0.2, 0.1), lobes=(Lobe(mx=0.3, my=0.3),)))


def test_by_hand() -> None:
    """One pixel, one term of two bands: 2 (3 x 0.5 + 5 x 4) = 43 in red, emission included."""
    step = Curve(np.where(np.arange(4097)[:, None] < 2048, 0.5, 4.0) * np.ones(3))
    start = Editable("hand", (Term("t", One(), (2.0, 1.0, 0.5), (Factor("c", "theta_h"),)),), {"c": step})
    transport = np.array([[3, 3, 3], [5, 5, 5]], np.float32)[..., None]
    part = Part(start, np.array([2]), np.zeros(1), (rows_of(transport),))
    background = np.arange(12, dtype=np.float32).reshape(2, 2, 3)
    picture = EditedPicture(background, {"hand": part})
    image = picture.image()
    # half a step at one knot: the mean of the curve's first half is .5 + 3.5 / 4096
    assert np.allclose(image[1, 0] - background[1, 0], [43, 21.5, 10.75], rtol=1e-3)
    assert np.array_equal(image.reshape(-1, 3)[[0, 1, 3]], background.reshape(-1, 3)[[0, 1, 3]])
    assert image.dtype == np.float32
    assert background[1, 0, 0] == 6


@pytest.mark.parametrize("name", ["lambert", "kurt", "cook-torrance", "oren-nayar", "ashikhmin-shirley"])
def test_it_is_the_direct_sum(name: str) -> None:
    start = editable(model_named(name)())
    part, bands = part_of(start, np.arange(5, 105), 1)
    picture = EditedPicture(np.zeros((HEIGHT, WIDTH, 3), np.float32), {"it": part})
    assert close(pixels_of(picture.image(), part), direct(part, bands, start))
    for curve in start.curves:
        start = start.with_curve(curve, Curve.of(lambda x: np.stack([np.cos(x), 1 + 0 * x, x], axis=1)))
        picture.show("it", start)
        while not picture.is_exact:
            picture.step(terms=5)
        assert close(pixels_of(picture.image(), part), direct(part, bands, start))
        picture.draw()
        assert close(pixels_of(picture.image(), part), direct(part, bands, start))


def test_two_materials_at_once(tray: Editable) -> None:
    pot = editable(model_named("cook-torrance")(m=0.4))
    parts = {"tray": part_of(tray, np.arange(0, 100), 1), "pot": part_of(pot, np.arange(110, 230), 7)}
    background = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    background.reshape(-1, 3)[100:110] = background.reshape(-1, 3)[230:] = 0.25
    picture = EditedPicture(background, {name: part for name, (part, _) in parts.items()})
    tinted = (replace(tray.terms[0], scale=(0.2, 0.1, 0.3)), *tray.terms[1:])
    edited = {"tray": replace(tray, terms=tinted), "pot": pot}
    frames = 0
    for name, by in (("tray", 1.0), ("pot", 0.5)):
        values = edited[name].curves["highlight"].values
        edited[name] = edited[name].with_curve("highlight", Curve(values + by * np.cos(angles_rad())[:, None] ** 2))
        picture.show(name, edited[name])
    while not picture.is_exact:
        picture.step(terms=8)
        frames += 1
    assert frames == 4  # 16 + 16 changed wavelets, 8 a frame; the tint takes none
    for name, (part, bands) in parts.items():
        assert close(pixels_of(picture.image(), part), direct(part, bands, edited[name]))
    assert np.all(picture.image().reshape(-1, 3)[100:110] == 0.25)
    assert np.all(picture.image().reshape(-1, 3)[230:] == 0.25)


def test_the_largest_changes_come_first_whosever_they_are(tray: Editable) -> None:
    part, _ = part_of(tray, np.arange(50), 3)
    other, _ = part_of(tray, np.arange(50, 100), 4)
    picture = EditedPicture(np.zeros((HEIGHT, WIDTH, 3), np.float32), {"a": part, "b": other})
    big, small = (Curve(tray.curves["highlight"].values * factor) for factor in (50, 1.001))
    picture.show("a", tray.with_curve("highlight", big))
    picture.show("b", tray.with_curve("highlight", small))
    before = picture.image().reshape(-1, 3)
    picture.step(terms=3)
    after = picture.image().reshape(-1, 3)
    assert np.abs(after - before)[:50].max() > 0
    assert np.allclose(after[50:100], before[50:100], rtol=1e-6)


def test_the_curve_that_changes_becomes_active() -> None:
    """Then it is edited by increments, and the other stays as it was edited."""
    start = editable(model_named("cook-torrance")(m=0.4))
    part, bands = part_of(start, np.arange(80), 5)
    folds: list[int] = []

    class Counted(DensePairs):
        def fold(self, curve_index: int, means: np.ndarray) -> Rows:
            folds.append(curve_index)
            return super().fold(curve_index, means)

    part = replace(part, transport=(Counted(bands["specular"]),))
    picture = EditedPicture(np.zeros((HEIGHT, WIDTH, 3), np.float32), {"pot": part})
    assert folds == [1]
    edited = start
    for curve, switches in (("highlight", 0), ("fresnel", 1), ("fresnel", 0), ("highlight", 1)):
        folds.clear()
        edited = edited.with_curve(curve, Curve(edited.curves[curve].values * 1.5 + 0.1))
        picture.show("pot", edited)
        picture.step()
        assert picture.is_exact
        assert len(folds) == switches
        assert close(pixels_of(picture.image(), part), direct(part, bands, edited))
    folds.clear()
    for curve in ("highlight", "fresnel"):
        edited = edited.with_curve(curve, Curve(edited.curves[curve].values + 0.3))
    picture.show("pot", edited)  # both at once
    picture.draw()
    assert close(pixels_of(picture.image(), part), direct(part, bands, edited))
    folds.clear()
    before = picture.image()
    picture.activate("pot", "fresnel")
    picture.activate("pot", "fresnel")
    assert folds == [0]
    assert close(picture.image(), before)


def test_what_the_transport_does_not_serve_is_said_and_changes_nothing() -> None:
    model = model_named("ggx")
    start = editable(model(alpha_x=0.3, alpha_y=0.3))
    part, bands = part_of(start, np.arange(80), 5)
    picture = EditedPicture(np.zeros((HEIGHT, WIDTH, 3), np.float32), {"it": part})
    before = picture.image()
    assert close(pixels_of(before, part), direct(part, bands, start))
    with pytest.raises(TransportNeeded) as caught:
        picture.show("it", editable(model(alpha_x=0.1, alpha_y=0.3)))
    assert caught.value.terms == ("specular",)
    assert picture.is_settled
    assert np.array_equal(picture.image(), before)
    edited = start.with_curve("highlight", Curve.constant(2.0))
    picture.show("it", edited)
    picture.draw()
    assert close(pixels_of(picture.image(), part), direct(part, bands, edited))


def test_a_material_that_no_pixel_shows_is_said(tray: Editable) -> None:
    picture = EditedPicture(np.zeros((HEIGHT, WIDTH, 3), np.float32), {"tray": part_of(tray, np.arange(80), 5)[0]})
    for ask in (lambda: picture.show("trap", tray), lambda: picture.activate("trap", "diffuse")):
        with pytest.raises(UserError, match="unknown material in view") as caught:
            ask()
        assert caught.value.expected == "tray" and "tray" in str(caught.value.hint)


def test_the_sun_fits_into_half_floats(tray: Editable) -> None:
    part, bands = part_of(tray, np.arange(80), 5)
    bright = {name: value * np.float32(1e9) for name, value in bands.items()}
    part = replace(part, transport=stored(bright.values()))
    picture = EditedPicture(np.zeros((HEIGHT, WIDTH, 3), np.float32), {"tray": part})
    assert close(pixels_of(picture.image(), part), direct(part, bright, tray))


def test_edits_without_end_do_not_drift(tray: Editable) -> None:
    """By curves of all sizes; once settled, the picture is the exact one to the bit."""
    part, bands = part_of(tray, np.arange(40), 5)
    picture, rng = EditedPicture(np.zeros((4, 10, 3), np.float32), {"tray": part}), np.random.default_rng(2)
    curves = [Curve.constant(v) for v in 10.0 ** rng.integers(-2, 3, 20)]
    curves += [Curve.of(lambda x, k=k: 1 + np.cos(k * x)) for k in range(20)]
    for _ in range(2_000):
        picture.show("tray", tray.with_curve("highlight", curves[rng.integers(len(curves))]))
        picture.step(terms=3)
    edited = tray.with_curve("highlight", curves[-1])
    picture.show("tray", edited)
    frames = 0
    while not picture.is_settled:
        picture.step()
        frames += 1
    assert frames <= 64
    drifted = picture.image()
    picture.draw()
    assert np.array_equal(drifted, picture.image())
    assert close(pixels_of(drifted, part), direct(part, bands, edited))


def test_no_edit_is_no_work(tray: Editable, monkeypatch: pytest.MonkeyPatch) -> None:
    part, _ = part_of(tray, np.arange(40), 5)
    picture = EditedPicture(np.zeros((HEIGHT, WIDTH, 3), np.float32), {"tray": part})
    picture.show("tray", tray)
    monkeypatch.setattr("lambent.editing.products.add_rows", None)
    picture.step()
    assert picture.is_settled


def test_changes_too_small_for_squares_end_as_well(tray: Editable) -> None:
    """The tail of a narrow highlight is 1e-200, and so are its changes: a picture that waits for them never rests."""
    pixels = np.arange(64)
    transport = tuple(Rows(np.full((n, 3, len(pixels)), 0.5, np.float16)) for n in (4, 256))
    part = Part(tray, pixels, np.zeros(len(pixels)), transport)
    picture = EditedPicture(np.zeros((8, 8, 3), np.float32), {"tray": part})
    for narrow in (1e3, 2e3, 1e5):
        edited = tray.with_curve("highlight", Curve.of(lambda x, n=narrow: 1e-5 * np.exp(-n * x * x)))
        picture.show("tray", edited)
        for _ in range(200):
            picture.step()
        assert picture.is_settled, narrow
    whole = tray.with_curve("highlight", Curve.of(lambda x: 1e-180 * np.cos(x)))
    picture.show("tray", whole)
    for _ in range(200):
        picture.step()
    assert picture.is_settled
