"""What frames of interreflections cost, and that they end at the whole sum, with random curves at both surfaces."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lambent.editing.canvas import HostCanvas
from lambent.editing.interreflection import whole as whole_module
from lambent.editing.interreflection.picture import FrozenPicture
from lambent.editing.products import HostProducts
from lambent.materials.factored.curve import KNOTS, Curve
from lambent.materials.factored.terms import Editable
from tests.editing.test_frozen_pictures import (
    CANVAS,
    DIFFUSE,
    GLOSSY,
    SIZE,
    SLOW,
    START,
    expected,
    light,
    shown,
    until_exact,
    whole_picture,
)  # fmt: skip

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
    frozen.show(later)
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
    frozen = FrozenPicture(source, START, "glossy", CANVAS, {"highlight"})
    assert frozen.serves(random_curves(GLOSSY, {"highlight"}, 0), "highlight")
    assert not frozen.serves(GLOSSY, "diffuse")
    assert not frozen.serves(random_curves(GLOSSY, {"diffuse"}, 0))


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
