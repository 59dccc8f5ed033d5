"""Shares of triangles in bands: known areas, Monte Carlo, degenerate corners."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.bake.transport.overlaps import share_below, spread
from lambent.materials.lobes import NUMPY


@pytest.mark.parametrize(
    ("corners", "y", "expected"),
    [
        ((0, 1, 2), 1, 0.5), ((0, 0, 1), 0.5, 0.75), ((0, 1, 1), 0.5, 0.25), ((2, 0, 1), 0.5, 0.125),
        ((0, 1, 2), 0, 0), ((0, 1, 2), 2, 1), ((0, 1, 2), -5, 0), ((0, 1, 2), 5, 1),
        ((1, 1, 1), 0.9, 0), ((1, 1, 1), 1.1, 1), ((0, 0, 1), 0, 0), ((0, 1, 1), 1, 1),
    ],
)  # fmt: skip
def test_known_shares(corners: tuple[float, ...], y: float, expected: float) -> None:
    assert share_below(y, spread(*map(np.float64, corners), NUMPY), NUMPY) == pytest.approx(expected)


def test_shares_are_those_of_random_points() -> None:
    rng = np.random.default_rng(1)
    inside = rng.dirichlet((1, 1, 1), 100_000)
    for corners in rng.normal(size=(20, 3)):
        edges = np.linspace(corners.min() - 0.1, corners.max() + 0.1, 12)
        found = share_below(edges, spread(*corners, NUMPY), NUMPY)
        counted = (inside @ corners < edges[:, None]).mean(axis=1)
        assert np.allclose(found, counted, atol=0.006)
        assert (np.diff(found) >= 0).all()


def test_bands_add_up_to_one() -> None:
    rng = np.random.default_rng(2)
    corners = rng.uniform(0, 1, (3, 5000)).astype(np.float32)
    corners[1, :1000] = corners[0, :1000]
    edges = np.linspace(0, 1, 129, dtype=np.float32)
    shares = np.diff(share_below(edges[:, None], spread(*corners, NUMPY), NUMPY), axis=0)
    assert shares.min() >= -1e-5
    assert np.allclose(shares.sum(axis=0), 1, atol=1e-6)
