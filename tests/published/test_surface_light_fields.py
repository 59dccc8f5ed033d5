"""Blends of a light field's maps and the surface that they show, in a room that is known by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.baked.light_fields.light_field import NO_POINT, LightField
from lambent.baked.light_fields.lookup import Place
from lambent.published.surface_light_fields import Basis, basis_weights, surface
from tests.baked.light_fields.analytic_light_field import BALL, OWN, ball_field, on_ball, places

BASES: tuple[Basis, ...] = ("nearest", "angle", "average", "reflection", "normal")


@pytest.fixture(scope="module")
def field() -> LightField:
    return ball_field()


@pytest.mark.parametrize("power", [1, 4, 16])
@pytest.mark.parametrize("basis", BASES)
def test_weights_are_a_partition_of_unity(field: LightField, basis: Basis, power: int) -> None:
    place, w = places(field)
    some = place.points.copy()
    some[::3, 2:] = NO_POINT
    some[::5] = NO_POINT
    weight = basis_weights(field, replace(place, points=some), w, basis, power)
    assert (weight >= 0).all() and (weight[some == NO_POINT] == 0).all()
    np.testing.assert_allclose(weight.sum(axis=1), (some != NO_POINT).any(axis=1), atol=1e-12)


def test_weights_by_hand() -> None:
    """A place under the middle of three points, one of which stands straight above it."""
    field = ball_field(3, 4)
    points = np.array([[0, 0.1, 0], [0.1, 0.1, 0], [-0.1, 0.0, 0]], np.float32)
    field = replace(field, points=points)
    place = Place(np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]]), np.array([[0, 1, 2, NO_POINT]]))
    w, half = np.array([[1.0, 0.0, 0.0]]), np.sqrt(0.5)
    for basis, power, expected in (
        ("nearest", 1, (1, 0, 0)),
        ("angle", 1, (0, 1, 0)),
        ("average", 1, (1 / 3, 1 / 3, 1 / 3)),
        ("reflection", 4, (0, 1, 0)),
        ("normal", 1, (1 / (1 + half), half / (1 + half), 0)),
        ("normal", 4, (0.8, 0.2, 0)),
    ):
        found = basis_weights(field, place, w, basis, power)
        np.testing.assert_allclose(found, [[*expected, 0]], atol=1e-6, err_msg=f"{basis} {power}")


def test_a_ball_is_seen_by_its_points(field: LightField) -> None:
    place, _ = places(field)
    light, visible = surface(field, place)
    assert visible.mean() > 0.99
    np.testing.assert_allclose(light[visible], np.broadcast_to(OWN, light[visible].shape), atol=1e-4)


def test_a_point_that_sees_something_else_does_not_show_the_surface(field: LightField) -> None:
    """A wall between the nearest point and the ball: the next one answers, and where all are covered, that is told."""
    radiance, nearness = field.radiance.copy(), field.inverse_distance.copy()
    radiance[0], nearness[0] = 50.0, 1000.0
    covered = replace(field, radiance=radiance, inverse_distance=nearness)
    n = np.repeat(on_ball(144)[:1], 2, axis=0)
    uv2 = np.stack([np.arctan2(n[:, 2], n[:, 0]) / (2 * np.pi) % 1, np.arccos(n[:, 1]) / np.pi], axis=-1)
    place = Place.at(covered, n * BALL, n, uv2)
    assert (place.points[:, 0] == 0).all()
    light, visible = surface(covered, place)
    assert visible.all()
    np.testing.assert_allclose(light, np.broadcast_to(OWN, light.shape), atol=1e-4)
    alone = replace(place, points=np.where(place.points == 0, 0, NO_POINT))
    assert not surface(covered, alone)[1].any()
