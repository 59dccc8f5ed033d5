"""Directions: angles, mirrored directions, half vectors and frames."""

import numpy as np
import pytest

from lambent.core.geometry.directions import (
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
    rotation_about,
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


def test_rotations_are_right_handed():
    np.testing.assert_allclose(rotation_about(np.array([0.0, 0.0, 1.0]), np.pi / 2) @ [1, 0, 0], [0, 1, 0], atol=1e-15)
    axis = normalize(np.array([1.0, -2.0, 0.5]))
    m = rotation_about(axis, 0.7)
    np.testing.assert_allclose(m @ m.T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(m @ axis, axis, atol=1e-15)
    assert np.linalg.det(m) == pytest.approx(1) and np.trace(m) == pytest.approx(1 + 2 * np.cos(0.7))
