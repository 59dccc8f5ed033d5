"""Directions: angles, mirrored directions, half vectors and frames."""

import numpy as np
import pytest

from lambent.core.directions import (
    FLIP_Z,
    HALF_TURN,
    angles,
    basis,
    direction,
    elevation,
    half_vector,
    normalize,
    raised,
    reflect,
)


@pytest.fixture
def w():
    random = np.random.default_rng(0)
    return normalize(random.normal(size=(200, 3)))


def test_angles_are_the_inverse_of_direction(w):
    theta, phi = angles(w)
    np.testing.assert_allclose(direction(theta, phi), w, atol=1e-15)
    np.testing.assert_array_equal(theta, elevation(w))
    assert (phi >= 0).all() and (phi < 2 * np.pi).all() and elevation(np.array([0.0, 0.0, -1.0])) == np.pi


def test_mirrored_and_turned_directions(w):
    theta, phi = angles(w)
    np.testing.assert_allclose(w * FLIP_Z, direction(np.pi - theta, phi), atol=1e-15)
    np.testing.assert_allclose(w * HALF_TURN, direction(theta, phi + np.pi), atol=1e-15)
    np.testing.assert_array_equal(raised(w), np.where(w[:, 2:] < 0, w * FLIP_Z, w))


def test_the_half_vector_mirrors_one_direction_to_the_other(w):
    wi, wo = w[:100], w[100:]
    np.testing.assert_allclose(reflect(wo, half_vector(wi, wo)), wi, atol=1e-12)
    np.testing.assert_array_equal(half_vector(wi, -wi), 0)


def test_frames_are_orthonormal_and_right_handed(w):
    t, b = basis(w)
    np.testing.assert_allclose(np.cross(t, b), w, atol=1e-15)
    np.testing.assert_allclose(np.sum(t * b, axis=-1), 0, atol=1e-15)
