"""Fixed-point iteration through a light field finds the walls of a room that is known by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.baked.light_fields.lookup import blended, normal_weights
from lambent.published.distance_impostors import fixed_point
from tests.baked.light_fields.analytic_light_field import ball_field, errors, places


@pytest.mark.long
def test_iteration_finds_the_walls() -> None:
    field = ball_field()
    place, w = places(field)
    by_rounds = fixed_point(field, place, w).radiance
    uncorrected = blended(field, place, w, normal_weights(field, place))
    assert np.median(errors(by_rounds, place, w)) < 0.03 * np.median(errors(uncorrected, place, w))
    constant = replace(field, radiance=np.full_like(field.radiance, 0.75), inverse_distance=0 * field.inverse_distance)
    answer = fixed_point(constant, place, w)
    np.testing.assert_allclose(answer.radiance, 0.75, rtol=1e-12)
    assert answer.sky.all() and not answer.met.any()
