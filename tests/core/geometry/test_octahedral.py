"""Octahedral maps: directions there and back, solid angles, and what lies beyond the edges of a map."""

import numpy as np
import pytest

from lambent.core.geometry.directions import normalize
from lambent.core.geometry.octahedral import bordered, from_square, texel_directions, texel_solid_angles, to_square


def test_directions_come_back():
    w = normalize(np.random.default_rng(1).normal(size=(10_000, 3)))
    np.testing.assert_allclose(from_square(to_square(3 * w)), w, atol=1e-12)


@pytest.mark.parametrize(
    ("w", "uv"),
    [
        ((0, 0, 1), (0.5, 0.5)),
        ((1, 0, 0), (1, 0.5)),
        ((0, 1, 0), (0.5, 1)),
        ((-1, 0, 0), (0, 0.5)),
        ((1, 1, -2), (0.75 + 0.125, 0.75 + 0.125)),
    ],
)
def test_known_places(w, uv):
    np.testing.assert_allclose(to_square(np.array(w, float)), uv, atol=1e-12)


def test_solid_angles_are_a_sphere():
    assert texel_solid_angles(64).sum() == pytest.approx(4 * np.pi, rel=1e-4)


def test_solid_angles_weigh_directions_evenly():
    weights, w = texel_solid_angles(64), texel_directions(64)
    second = np.einsum("ij,ijk,ijl->kl", weights, w, w)
    np.testing.assert_allclose(second, 4 * np.pi / 3 * np.eye(3), atol=2e-3)


@pytest.mark.parametrize("n", [2, 5, 8, 32])
def test_borders_go_on_as_the_map_does(n):
    """Steps across an edge are no longer than the longest within the map."""
    inside, around = texel_directions(n), bordered(texel_directions(n), min(2, n))
    for axis in (0, 1):
        longest = np.linalg.norm(np.diff(inside, axis=axis), axis=-1).max()
        assert np.linalg.norm(np.diff(around, axis=axis), axis=-1).max() <= longest + 1e-9
