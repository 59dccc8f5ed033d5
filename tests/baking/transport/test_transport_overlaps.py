"""Shares of triangles below an angle, and integrals over them: known areas, Monte Carlo, degenerate corners."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baking.transport.overlaps import below, spread
from lambent.materials.lobes import NUMPY

ZERO = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("corners", "y", "expected"),
    [
        ((0, 1, 2), 1, 0.5), ((0, 0, 1), 0.5, 0.75), ((0, 1, 1), 0.5, 0.25), ((2, 0, 1), 0.5, 0.125),
        ((0, 1, 2), 0, 0), ((0, 1, 2), 2, 1), ((0, 1, 2), -5, 0), ((0, 1, 2), 5, 1),
        ((1, 1, 1), 0.9, 0), ((1, 1, 1), 1.1, 1), ((0, 0, 1), 0, 0), ((0, 1, 1), 1, 1),
    ],
)  # fmt: skip
def test_known_shares(corners: tuple[float, ...], y: float, expected: float) -> None:
    assert below(y, spread(tuple(map(np.float64, corners)), ZERO, NUMPY), NUMPY)[0] == pytest.approx(expected)


def test_shares_and_integrals_are_those_of_random_points() -> None:
    """Of both angles, from their values at the corner where the first is lowest."""
    rng = np.random.default_rng(1)
    inside = rng.dirichlet((1, 1, 1), 100_000)
    for a, b in rng.normal(size=(20, 2, 3)):
        edges = np.linspace(a.min() - 0.1, a.max() + 0.1, 12)
        found = below(edges, spread(tuple(a), tuple(b), NUMPY), NUMPY)
        here = inside @ a < edges[:, None]
        counted = here.mean(axis=1), *((here * (inside @ x - x[a.argmin()])).mean(axis=1) for x in (a, b))
        assert all(np.allclose(f, c, atol=0.02) for f, c in zip(found, counted, strict=True))
        assert (np.diff(found[0]) >= 0).all() and (np.diff(found[1]) >= 0).all()


def test_parts_add_up_to_the_whole() -> None:
    rng = np.random.default_rng(2)
    a, b = rng.uniform(0, 1, (2, 3, 5000)).astype(np.float32)
    a[1, :1000] = a[0, :1000]
    a[:, :100] = a[0, :100]
    edges = np.linspace(0, 1, 129, dtype=np.float32)
    share, of_a, of_b = (np.diff(x, axis=0) for x in below(edges[:, None], spread(tuple(a), tuple(b), NUMPY), NUMPY))
    assert share.min() >= -1e-5
    assert np.allclose(share.sum(axis=0), 1, atol=1e-6)
    assert np.allclose(of_a.sum(axis=0) + a.min(axis=0), a.mean(axis=0), atol=1e-6)
    lowest = np.take_along_axis(b, a.argmin(axis=0)[None], axis=0)[0]
    varied = slice(100, None)  # where all of a is alike, any corner may be the lowest
    assert np.allclose((of_b.sum(axis=0) + lowest)[varied], b.mean(axis=0)[varied], atol=1e-5)
