"""Edited pictures of stored transport are the same on the GPU and in memory."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from lambent.editing.picture import EditedPicture, Part
from lambent.editing.rows import PairTransport, Rows
from lambent.editing.stored import StoredPairs
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.of_models import editable
from lambent.materials.factored.terms import Editable
from lambent.materials.models import model_named
from lambent.viewer.edits.edited import ShadedCanvas
from tests.editing.dense_rows import DensePairs, rows_of
from tests.editing.test_folding import sparse

PIXEL = np.sort(np.random.default_rng(0).permutation(200)[:71])
BACKGROUND = np.random.default_rng(1).random((10, 20, 3)).astype(np.float32)


def part_of(start: Editable, seed: int, *, stored: bool = True) -> Part:
    """Rows of terms with one curve; pairs of those with two, as in a store or whole."""
    rng = np.random.default_rng(seed)
    transport: list[Rows | PairTransport] = []
    for term in start.terms:
        if len(term.factors) < 2:
            transport.append(rows_of(rng.random((16, 3, len(PIXEL))).astype(np.float32)))
        elif stored:
            transport.append(StoredPairs(*sparse(len(PIXEL), (32, 16), 90, seed), 0.25, (32, 16)))
        else:
            transport.append(DensePairs(rng.random((8, 4, 3, len(PIXEL))).astype(np.float32)))
    return Part(start, PIXEL, rng.uniform(0, 1.5, len(PIXEL)), tuple(transport))


def assert_close(found: np.ndarray, expected: np.ndarray) -> None:
    assert np.abs(found - expected).max() <= 1e-3 * np.abs(expected).max()


@pytest.mark.parametrize(("name", "stored"), [("kurt", True), ("cook-torrance", False), ("oren-nayar", True)])
def test_a_session_of_edits_is_the_same_everywhere(device: Any, name: str, stored: bool) -> None:
    """Frames, switched curves, a viewer's curve, a colour, and better transport on the way."""
    start, rng = editable(model_named(name)()), np.random.default_rng(4)
    parts = {"it": part_of(start, 5, stored=stored)}
    pictures = [EditedPicture(BACKGROUND, parts), EditedPicture(BACKGROUND, parts, partial(ShadedCanvas, device))]
    now = start
    for curve in [*start.curves, *start.curves]:
        knots = rng.uniform(0.2, 2, (4, 3))
        now = now.with_curve(curve, Curve.through(np.linspace(0, 1.57, 4), knots))
        now = replace(now, terms=tuple(replace(term, scale=tuple(rng.random(3))) for term in now.terms))
        for picture in pictures:
            picture.show("it", now)
            picture.step(terms=5)
        host, shaded = (picture.image() for picture in pictures)
        assert_close(shaded, host)
    for picture in pictures:
        picture.put("it", part_of(start, 6, stored=stored))
        picture.show("it", now)
        while not picture.is_settled:
            picture.step()
    settled = [picture.image() for picture in pictures]
    assert_close(settled[1], settled[0])
    assert np.abs(settled[0] - host).max() > 0.01
