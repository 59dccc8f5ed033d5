"""Freezing: the polynomial in one material is the whole sum, and incremental frames reach it."""

from __future__ import annotations

import time
from dataclasses import replace
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baked.shared_exponent import packed_rgb, unpacked_rgb
from lambent.baked.transport.tails import FIXED, SecondBands, Tails
from lambent.core.views.camera import Camera
from lambent.editing.canvas import HostCanvas, viewed
from lambent.editing.interreflection import entries
from lambent.editing.interreflection import whole as whole_module
from lambent.editing.interreflection.entries import Cells, TermLight
from lambent.editing.interreflection.noise import light_of, noise
from lambent.editing.interreflection.picture import FrozenPicture
from lambent.editing.interreflection.powers import bands_of, powers
from lambent.editing.interreflection.stored import Interreflections, PartLight, interreflections
from lambent.editing.interreflection.whole import WholePicture
from lambent.editing.picture import EditedPicture, Part
from lambent.editing.products import HostProducts
from lambent.editing.rows import Rows
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.albedo import albedo, term_albedo
from lambent.materials.factored.curve import END_RAD, KNOTS, Curve
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.terms import Editable, Term
from lambent.store.contract import view_artefact_name
from lambent.store.store import Store
from tests.editing.dense_rows import DensePairs, second_coefficients

SIZE = (7, 5)
CANVAS = HostCanvas(np.zeros((*SIZE, 3), np.float32))
GLOSSY = of_material(Material(kd=(0.4, 0.3, 0.2), lobes=(Lobe(mx=0.3, my=0.3, r0=0.5),)))
PAPER = of_material(Material(kd=(0.7, 0.6, 0.5), kt_d=0.2))
KNOWN = of_material(Material(kd=0.3))
START = {"glossy": GLOSSY, "paper": PAPER, "known": KNOWN}
SLOTS = (("glossy", "reflection"), ("paper", "reflection"), ("paper", "transmission"), ("", FIXED))
DIFFUSE = Tails(SLOTS, 4)
SLOW = Tails(
    SLOTS, 3,
    (
        SecondBands("glossy", 0, (2,)), SecondBands("glossy", 1, (8, 2)), SecondBands("paper", 0, (2,)),
        SecondBands("paper", 1, (2,)), SecondBands("", 0, ()),
    ),
)  # fmt: skip


def light(tails: Tails, seed: int = 0) -> Interreflections:
    """Random light of three materials, sparse."""
    rng = np.random.default_rng(seed)
    order, parts = rng.permutation(35), {}
    for name, part in zip(START, np.split(order, [12, 24]), strict=True):
        terms = []
        for term in START[name].terms if name != "known" else (None,):
            counts = tuple(16 if k == 0 else 4 for k in range(len(term.factors))) if term else ()
            dense = rng.random((len(part), len(tails) * int(np.prod(counts, dtype=int)), 3)) ** 8
            dense[rng.random(dense.shape[:2]) < 0.7] = 0
            point, code = np.nonzero(dense.any(axis=2))
            each = np.bincount(point, minlength=len(part))
            units = np.where(np.arange(len(part)) < 6, 2.0, 0.25).astype(np.float32)
            values = packed_rgb((dense[point, code] / units[point, None]).astype(np.float32))
            terms.append(TermLight.of_tiles([(each, code.astype(np.uint32), values)], units, counts))
        theta_o = rng.uniform(0, 1.5, len(part)).astype(np.float32)
        parts[name] = PartLight(START[name], np.sort(part), theta_o, tuple(terms), name != "known")
    return Interreflections(SIZE, tails, parts, 1)


def expected(whole: Interreflections, materials: dict[str, Editable], hits: tuple[int, int] = (2, 99)) -> np.ndarray:
    """(H, W, 3) by the sum over everything, entry by entry."""
    tails = whole.tails
    albedos = np.array([np.ones(3) if side == FIXED else albedo(materials[name], side) for name, side in tails.slots])
    weights = tails.weights(albedos, second_coefficients(tails, materials))
    weights[(tails.hits < hits[0]) | (tails.hits > hits[1])] = 0
    image = np.zeros((SIZE[0] * SIZE[1], 3))
    for name, part in whole.parts.items():
        for k, term in enumerate(part.terms):
            bands, scale = np.ones((1, 3)), np.ones(3)
            if part.edited:
                edited = materials[name].terms[k]
                bands, scale = bands_of(edited.factors, term.counts, materials[name]), np.array(edited.scale)
            tail, band = np.divmod(term.codes, len(bands))
            point = np.repeat(np.arange(len(part.pixel)), np.diff(term.ends))
            if part.edited and edited.viewer:
                scale = scale * viewed(part.theta_o, materials[name].curves[edited.viewer]).T[point]
            values = unpacked_rgb(term.values) * term.units[point, None]
            np.add.at(image, part.pixel[point], values * weights[tail] * bands[band] * scale)
    return image.reshape(*SIZE, 3)


def shown(frozen: FrozenPicture) -> np.ndarray:
    CANVAS.compose(frozen.shown)
    return CANVAS.image()


@pytest.mark.parametrize("tails", [DIFFUSE, SLOW], ids=["diffuse", "slow"])
@pytest.mark.parametrize("edited", START)
@pytest.mark.parametrize("hits", [(2, 99), (3, 3)])
def test_frozen_pictures_are_the_whole_sum(tails: Tails, edited: str, hits: tuple[int, int]) -> None:
    whole = light(tails)
    frozen = FrozenPicture(whole, START, edited, CANVAS, hits=hits)
    reference = expected(whole, START, hits)
    assert np.abs(shown(frozen) - reference).max() < 2e-3 * reference.max()


@pytest.mark.parametrize("tails", [DIFFUSE, SLOW])
def test_the_light_that_noise_is_measured_by_is_the_whole_sum(tails: Tails) -> None:
    whole = light(tails)
    pixel = np.concatenate([part.pixel for part in whole.parts.values()])
    wanted = expected(whole, START).reshape(-1, 3)[pixel]
    np.testing.assert_allclose(light_of(whole, START).T, wanted, rtol=1e-3, atol=1e-4)


def test_noise_is_found_from_two_passes() -> None:
    rng = np.random.default_rng(2)
    each = 5 + rng.exponential(2.0, (96, 1, 4000)).repeat(3, axis=1) - 2
    before, after = each[:16].mean(axis=0), each.mean(axis=0)
    assert noise(before, after, (16, 96)) == pytest.approx(2 / 96**0.5 / 5, rel=0.05)


def test_the_idle_curve_wants_to_be_frozen_anew() -> None:
    frozen = FrozenPicture(light(DIFFUSE), START, "glossy", CANVAS, {"highlight"})
    first, second = (factor.curve for factor in GLOSSY.terms[1].factors)
    flat = GLOSSY.with_curve(second, Curve.constant(0.3))
    assert frozen.serves(GLOSSY, first) and frozen.serves(random_curves(GLOSSY, {first}, 0), first)
    assert not frozen.serves(flat, None) and not frozen.serves(GLOSSY, second)
    assert not frozen.serves(random_curves(GLOSSY, {"diffuse"}, 0), None)
    anew = FrozenPicture(light(DIFFUSE), {**START, "glossy": flat}, "glossy", CANVAS, {second})
    assert anew.serves(flat, second)
    reference = expected(light(DIFFUSE), {**START, "glossy": flat})
    assert np.abs(shown(anew) - reference).max() < 2e-3 * reference.max()


def test_monomials_are_those_of_the_material_alone() -> None:
    """Of 4 slots, paper has two: its monomials are d^a t^b with a + b up to 3, one for each other tail's rest."""
    found = powers(DIFFUSE, START, "paper")
    counts = {order for size in range(4) for order in combinations_with_replacement("dt", size)}
    assert len(found.exponents) == len(counts)
    assert found.values(PAPER).max() <= 1
    lengths = sorted(found.exponents.sum(axis=1).tolist())
    assert lengths == sorted(len(order) for order in counts)


def test_no_loop_runs_where_nothing_contributes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without cells, loops would add to sums that are not there: their compiled additions are not checked."""

    def never(*_: object) -> None:
        raise AssertionError("a loop ran")

    power, term = powers(DIFFUSE, START, "paper", (1, 1)), light(DIFFUSE).parts["paper"].terms[0]
    cells = Cells.of(power, term.met)
    monkeypatch.setattr(entries, "_rows", never)
    monkeypatch.setattr(entries, "_pixels", never)
    band = np.ones((term.bands, 3))
    held, _ = entries.rows(term, band, power.weight, cells, np.zeros(term.bands, int), 1)
    assert len(cells) == len(held) == 0 < len(term.values)
    entries.add_pixels(np.zeros((0, 3, len(term.units)), np.float32), term, band, power.weight, cells, np.ones((3, 1)))


def whole_picture(light_of: Interreflections) -> WholePicture:
    """Direct light of nothing, and interreflections."""
    whole = WholePicture(EditedPicture(np.zeros((*SIZE, 3), np.float32), dark_parts(light_of)))
    whole.give(light_of, START)
    return whole


def dark_parts(light_of: Interreflections) -> dict[str, Part]:
    """Transport of nothing for the same pixels."""
    parts = {}
    for name, part in light_of.parts.items():
        transport = tuple(_no_light(term, len(part.pixel)) for term in START[name].terms)
        parts[name] = Part(START[name], part.pixel, part.theta_o, transport)
    return parts


def _no_light(term: Term, points: int) -> Rows | DensePairs:
    if len(term.factors) < 2:
        return Rows(np.zeros((4 if term.factors else 1, 3, points), np.float16))
    return DensePairs(np.zeros((4, 2, 3, points), np.float32))


@pytest.mark.parametrize("m", [0.03, 0.07, 0.2])
def test_bands_wider_than_a_peak_reflect_its_light(m: float) -> None:
    """16 bands at the second surface under uniform light."""
    shiny = of_material(Material(lobes=(Lobe(mx=m, my=m, r0=0.5),)))
    tails = Tails((("shiny", "reflection"),), 2, (SecondBands("shiny", 0, (16, 1)),))
    steps = second_coefficients(tails, {"shiny": shiny})
    assert len(steps) == 16
    flat = replace(shiny.terms[0], scale=(1.0, 1.0, 1.0))
    bands = np.repeat(steps, KNOTS // 16, axis=0)
    stepped = {"highlight": Curve(np.vstack([bands, bands[-1:]])), "fresnel": Curve.constant()}
    found = term_albedo(flat, stepped) / albedo(shiny, "reflection")
    assert np.abs(found - 1).max() < 0.1, found


def until_exact(whole: WholePicture) -> None:
    for _ in range(5000):
        whole.step()
        if whole.is_settled:
            return
        time.sleep(0.001)
    raise AssertionError("it never settles")


def test_any_material_may_be_next() -> None:
    """Switching from one to another goes on in the background, whatever changes meanwhile; the end is exact."""
    source = light(DIFFUSE)
    whole = whole_picture(source)
    later = {
        "glossy": of_material(Material(kd=(0.1, 0.8, 0.4), lobes=(Lobe(mx=0.15, my=0.15, r0=0.5),))),
        "paper": of_material(Material(kd=(0.2, 0.6, 0.9), kt_d=0.4)), "known": KNOWN,
    }  # fmt: skip
    whole.step()
    whole.show("glossy", later["glossy"])
    whole.step()
    whole.show("paper", later["paper"])
    until_exact(whole)
    for hits in ((1, 99), (1, 1), (2, 2), (3, 99)):
        whole.see(hits)
        until_exact(whole)
        reference = expected(source, later, (max(2, hits[0]), hits[1]))
        assert np.abs(whole.image() - reference).max() < 2e-3 * max(reference.max(), 1)
    whole.see((1, 99))
    whole.show("glossy", START["glossy"])
    whole.draw()
    assert whole.is_exact
    reference = expected(source, {**later, "glossy": GLOSSY})
    assert np.abs(whole.image() - reference).max() < 2e-3 * reference.max()
    whole.close()


def test_other_terms_show_direct_light_alone() -> None:
    """Interreflections of a quotient that the material no longer has are taken away, until others are given."""
    source = light(DIFFUSE)
    whole = whole_picture(source)
    whole.draw()
    assert whole.image().any()
    other = of_material(Material(kd=0.3, lobes=(Lobe(mx=0.1, my=0.3, r0=0.5),)))
    transport = tuple(_no_light(term, len(source.parts["glossy"].pixel)) for term in other.terms)
    whole.direct.put("glossy", Part(other, source.parts["glossy"].pixel, source.parts["glossy"].theta_o, transport))
    whole.show("glossy", other)
    until_exact(whole)
    assert not whole.image().any()
    whole.close()


def test_tiles_that_are_not_there_yet_are_black(tmp_path: Path) -> None:
    """A store that a first pass has just begun: tails, and tiles of one term of one material."""
    camera, size = Camera("front", (0, 0, 1), (0, 0, 0)), (4, 2)

    def name(kind: str, part: str) -> str:
        return view_artefact_name(camera, *size, kind, part)

    with Store.create(tmp_path, {}) as store:
        objects = {"objects": [["a", "glossy"], ["b", "paper"]]}
        store.put(name("view_points", "pixel"), "p", np.arange(8, dtype=np.uint32), key="0")
        store.put(name("view_points", "object"), "p", np.repeat([0, 1], 4).astype(np.uint32), key="0", meta=objects)
        store.put(name("view_points", "theta_o"), "p", np.zeros(8, np.float32), key="0")
        said = {"tails": DIFFUSE.said(), "environment": None}
        store.put(name("interreflection", "tails"), "interreflection", np.zeros(1, np.uint32), key="0", meta=said)
        tile = np.concatenate([[1, 0, 0, 0], [0], packed_rgb(np.array([[1.0, 2.0, 4.0]], np.float32))]).astype(
            np.uint32
        )
        meta = {"points": 4, "samples": 16, "unit": 0.5, "curves": [["diffuse", 4]], "fixed": GLOSSY.terms[0].fixed}
        store.put(name("interreflection", "glossy/0/0"), "interreflection", tile, key="0", meta=meta)
        found = interreflections(store, camera, size, {"glossy": GLOSSY, "paper": PAPER})
    assert found.samples == 0 and [term.counts for term in found.parts["glossy"].terms] == [(4,), (1, 1)]
    for edited in ("glossy", "paper"):
        canvas = HostCanvas(np.zeros((2, 4, 3), np.float32))
        canvas.compose(FrozenPicture(found, START, edited, canvas).shown)
        image = canvas.image().reshape(-1, 3)
        assert image[0].all() and not image[1:].any()


def test_curves_of_the_viewer_are_interpolated_between_their_knots() -> None:
    ramp = Curve(np.multiply.outer(np.arange(KNOTS + 1.0), [1.0, 2.0, -3.0]))
    step = np.array([-9.0, 0.0, 0.25, 700.75, KNOTS - 0.5, KNOTS, KNOTS + 9.0])
    found = viewed((step * END_RAD / KNOTS).astype(np.float32), ramp)
    assert np.allclose(found, np.multiply.outer([1.0, 2.0, -3.0], step.clip(0, KNOTS)), rtol=1e-5, atol=1e-3)


CURVES = {"diffuse", "highlight"}


def random_curves(start: Editable, names: set[str], seed: int) -> Editable:
    """Steps of any height, narrower than any band."""
    rng = np.random.default_rng(seed)
    for name in sorted(names):
        steps = np.repeat(rng.random((KNOTS // 64, 3)) ** 3, 64, axis=0)
        start = start.with_curve(name, Curve(np.vstack([steps, steps[-1:]])))
    return start


@pytest.mark.parametrize("tails", [DIFFUSE, SLOW], ids=["diffuse", "slow"])
@pytest.mark.parametrize("seed", range(3))
def test_random_curves_by_frames(tails: Any, seed: int) -> None:
    """The same curve counts at first and second surfaces, where the material sees itself as a product of both."""
    source = light(tails, seed)
    frozen = FrozenPicture(source, START, "glossy", CANVAS, CURVES)
    later = random_curves(GLOSSY, CURVES, seed)
    assert frozen.serves(later, None)
    frozen.show(later)
    assert not frozen.is_exact
    for _ in range(2000):
        frozen.step(3)
        if frozen.is_settled:
            break
    reference = expected(source, {**START, "glossy": later})
    assert frozen.is_settled
    assert np.abs(shown(frozen) - reference).max() < 1e-3 * reference.max()


def test_a_frame_costs_no_more_than_its_terms(monkeypatch: pytest.MonkeyPatch) -> None:
    """However many bands second surfaces have: a layer for each monomial of a part, rows times pixels as are given."""
    source, added = light(SLOW), []
    frozen = FrozenPicture(source, START, "glossy", CANVAS, CURVES)
    monomials = len(np.unique(SLOW.exponents[:, 0]))
    assert len(frozen.shown) <= monomials * sum(len(part.terms) for part in source.parts.values())
    add_rows = HostProducts.add_rows

    def counted(self: Any, rows: Any, weights: Any, part: slice = slice(None), *, anew: bool = False) -> None:
        added.append(0 if anew else len(rows) * self.shape[2])
        add_rows(self, rows, weights, part, anew=anew)

    monkeypatch.setattr(HostProducts, "add_rows", counted)
    frozen.show(random_curves(GLOSSY, CURVES, 1))
    for terms in (20, 5, 10):
        added.clear()
        frozen.step(terms)
        assert 0 < sum(added) <= terms * 35
    frozen.show(GLOSSY)
    frozen.draw()
    added.clear()
    frozen.step(10)
    assert not added, "no edit is no work"


def test_curves_that_are_not_edited_have_no_rows() -> None:
    """The bytes of transport are those of the active curve alone."""
    source = light(SLOW)

    def rows(active: set[str]) -> int:
        frozen = FrozenPicture(source, START, "glossy", CANVAS, active)
        return sum(layer.products.shape[0] for layer, _ in frozen.shown)  # type: ignore[attr-defined]

    assert rows(set()) < rows({"diffuse"}) < rows(CURVES)


def test_a_drag_freezes_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Frames that come while the polynomial is made want no other one; the last of them is what is shown."""
    made = []

    class Counted(FrozenPicture):
        def __init__(self, *given: Any) -> None:
            made.append(given[4])
            super().__init__(*given)

    source = light(SLOW)
    whole = whole_picture(source)
    whole.draw()
    monkeypatch.setattr(whole_module, "FrozenPicture", Counted)
    for seed in range(8):
        later = random_curves(GLOSSY, {"highlight"}, seed)
        whole.show("glossy", later)
        whole.step()
    until_exact(whole)
    assert made == [{"highlight"}]
    reference = expected(source, {**START, "glossy": later})
    assert np.abs(whole.image() - reference).max() < 1e-3 * reference.max()
    whole.close()


def test_on_a_gpu_frames_are_the_same(adapter: None) -> None:
    from lambent.realtime.gpu.device import open_device
    from lambent.viewer.edits.edited import ShadedCanvas

    source, black = light(SLOW), np.zeros((*SIZE, 3), np.float32)
    canvases = [HostCanvas(black), ShadedCanvas(open_device(), black)]
    pictures = [FrozenPicture(source, START, "glossy", canvas, CURVES) for canvas in canvases]
    for frame in range(6):
        later = random_curves(GLOSSY, CURVES, frame // 2)
        images = []
        for canvas, picture in zip(canvases, pictures, strict=True):
            picture.show(later)
            picture.step(20)
            canvas.compose(picture.shown)
            images.append(canvas.image())
        assert np.abs(images[0] - images[1]).max() < 1e-4 * images[0].max()
