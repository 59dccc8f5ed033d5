"""Wavelets on triangles are orthonormal and exact; light turns with its environment."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.geometry.directions import normalize
from lambent.editing.relit_view import SparseRows
from lambent.scenes.sky.triangle_lights import icosahedron
from lambent.scenes.sky.triangle_wavelets import FACES, TriangleTree, TurningLight


def directions(count: int, seed: int = 1) -> np.ndarray:
    return normalize(np.random.default_rng(seed).normal(size=(count, 3)))


def sky(w: np.ndarray) -> np.ndarray:
    """A smooth sky with a lamp."""
    lamp = np.exp(40 * (w @ normalize(np.array([1.0, 2.0, 0.5])) - 1))
    return np.stack([1 + w[:, 1], 1 + 0 * w[:, 1] + 5 * lamp, 0.5 - 0.3 * w[:, 0]], axis=1)


def turned_about_y(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


@pytest.mark.parametrize("depth", [0, 1, 2, 3])
def test_triangles_cover_the_sphere_once(depth: int) -> None:
    tree = TriangleTree(depth)
    assert len(tree) == len(tree.corners) == FACES * 4**depth
    assert tree.areas_sr.sum() == pytest.approx(4 * np.pi)
    a, b, c = np.moveaxis(tree.corners, 1, 0)
    assert (np.sum(np.cross(a, b) * c, axis=1) > 0).all()


@pytest.mark.parametrize("depth", [0, 1, 2])
def test_the_basis_is_orthonormal(depth: int) -> None:
    tree = TriangleTree(depth)
    root = np.sqrt(tree.areas_sr)
    matrix = tree.of_radiance(np.diag(1 / root))
    assert np.allclose(matrix @ matrix.T, np.eye(len(tree)), atol=1e-13)


def test_the_inverse_is_exact() -> None:
    tree = TriangleTree(3)
    values = np.random.default_rng(2).random((len(tree), 3))
    assert np.allclose(tree.radiance(tree.of_radiance(values)), values, rtol=1e-12)


def test_pictures_are_the_direct_sum() -> None:
    """of_transport . of_radiance = the sum over triangles, whatever their areas."""
    tree, rng = TriangleTree(2), np.random.default_rng(3)
    radiance, transport = rng.random((len(tree), 3)), rng.random((len(tree), 3, 7))
    found = np.einsum("nc,ncp->cp", tree.of_radiance(radiance), tree.of_transport(transport))
    assert np.allclose(found, np.einsum("nc,ncp->cp", radiance, transport), rtol=1e-12)


def test_constant_light_has_no_details() -> None:
    """Though the triangles differ in area."""
    tree = TriangleTree(3)
    assert tree.areas_sr.max() > 1.1 * tree.areas_sr.min()
    coefficients = tree.of_radiance(np.ones((len(tree), 3)))
    assert np.allclose(coefficients[:FACES], np.sqrt(4 * np.pi / FACES))
    assert np.allclose(coefficients[FACES:], 0, atol=1e-14)


def test_one_face_by_hand() -> None:
    """At depth 1, light in a middle child alone: its mean is the square root of its share; corners detail alike."""
    tree = TriangleTree(1)
    radiance = np.zeros((len(tree), 1))
    radiance[3] = 1
    coefficients = tree.of_radiance(radiance)[:, 0]
    area, face = tree.areas_sr[3], tree.areas_sr[:4].sum()
    assert coefficients[0] == pytest.approx(area / np.sqrt(face))
    details = coefficients[FACES : FACES + 3]
    assert np.allclose(details, details[0])
    assert np.sum(coefficients**2) == pytest.approx(area)


def test_directions_are_found_in_their_triangles() -> None:
    tree, w = TriangleTree(3), directions(2000)
    corners = tree.corners[tree.containing(w)]
    for k in range(3):
        inward = np.cross(corners[:, k], corners[:, (k + 1) % 3])
        assert (np.sum(inward * w, axis=1) > -1e-12).all()


def test_means_keep_the_light_and_fill_empty_triangles() -> None:
    w = directions(40_000)
    weight = np.full(len(w), 4 * np.pi / len(w))
    coarse = TriangleTree(1).means(w, weight, sky(w))
    light = (coarse * TriangleTree(1).areas_sr[:, None]).sum(axis=0)
    assert np.allclose(light, (sky(w) * weight[:, None]).sum(axis=0), rtol=0.01)
    sparse = TriangleTree(4).means(w[:500], weight[:500], np.full((500, 3), 2.5))
    assert np.allclose(sparse, 2.5)
    assert not TriangleTree(1).means(w[:0], weight[:0], w[:0]).any()


def test_a_turn_by_a_symmetry_moves_the_triangles_exactly() -> None:
    """A turn by a fifth about a corner of the icosahedron permutes all triangles."""
    axis, angle = icosahedron()[0, 0], 2 * np.pi / 5
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    rotation = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    tree, w = TriangleTree(2), directions(100_000)
    light = TurningLight.of_samples(tree, w, np.full(len(w), 1e-4), sky(w))
    centres = normalize(tree.corners.sum(axis=1))
    from_where = tree.containing(centres @ rotation)
    assert sorted(from_where) == list(range(len(tree)))
    assert np.allclose(light.radiance(rotation), light.radiance()[from_where], rtol=1e-9)


def test_a_turned_environment_is_the_environment_turned() -> None:
    tree, w = TriangleTree(2), directions(200_000)
    weight, rotation = np.full(len(w), 4 * np.pi / len(w)), turned_about_y(0.4)
    turned = TurningLight.of_samples(tree, w, weight, sky(w)).radiance(rotation)
    expected = tree.means(w @ rotation.T, weight, sky(w))
    assert np.abs(turned - expected).max() < 0.1
    assert np.abs(TurningLight.of_samples(tree, w, weight, sky(w)).radiance() - expected).max() > 0.5


def sparse(rows: np.ndarray, block: int) -> SparseRows:
    """Rows (J, 3, P) without their zeros, written one by one."""
    spans, points, values = [], [], []
    for first in range(0, rows.shape[2], block):
        spans.append([])
        for row in rows[:, :, first : first + block]:
            spans[-1].append(len(points))
            for p in np.flatnonzero(row.any(axis=0)):
                points.append(p)
                values.append(row[:, p])
        spans[-1].append(len(points))
    arrays = np.array(spans), np.array(points, np.uint16), np.array(values, np.float16)
    return SparseRows(*arrays, block, rows.shape[2])


def test_sparse_rows_are_the_dense_ones() -> None:
    """Across blocks of which the last is short, and with rows that no weight asks for."""
    rng = np.random.default_rng(6)
    rows = ((rng.random((20, 1, 23)) < 0.3) * rng.random((20, 3, 23))).astype(np.float16)
    weights = rng.normal(size=(20, 3)) * (rng.random(20) < 0.5)[:, None]
    found = sparse(rows, 9).summed(weights)
    assert np.allclose(found, np.einsum("kc,kcp->cp", weights, rows.astype(float)), atol=1e-6)


def test_a_turned_lamp_keeps_its_light() -> None:
    """A lamp as small as a part of a triangle is never missed, and never counts twice."""
    tree, picture = TriangleTree(2), np.full((64, 128, 3), 0.1, np.float32)
    picture[20, 40] = 5000.0
    light = TurningLight.of_picture(tree, picture)
    total = [(light.radiance(turned_about_y(a)) * tree.areas_sr[:, None]).sum(axis=0) for a in np.arange(20) * 0.3]
    assert np.allclose(total, (light.radiance() * tree.areas_sr[:, None]).sum(axis=0), rtol=0.01)
