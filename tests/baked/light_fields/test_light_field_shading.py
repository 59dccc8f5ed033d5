"""Turned surroundings of light fields."""

from __future__ import annotations

import numpy as np

from lambent.baked.light_fields.lookup import marched
from lambent.baked.light_fields.shading import turned, under_sky
from lambent.core.geometry.directions import normalize, rotation_about
from tests.baked.light_fields.analytic_light_field import ball_field, places, sky_light


def test_a_turned_sky_is_seen_through_the_roof_alone() -> None:
    field = ball_field(144, 64, open_roof=True)
    rotation = rotation_about(np.array([0.0, 1.0, 0.0]), 1.1)
    sky = turned(sky_light, rotation)
    w = normalize(np.random.default_rng(6).normal(size=(20, 3)))
    np.testing.assert_allclose(sky(w @ rotation.T), sky_light(w), atol=1e-12)
    relit = under_sky(field, sky)
    open_sky = field.inverse_distance == 0
    np.testing.assert_array_equal(relit.radiance[~open_sky], field.radiance[~open_sky])
    place, d = places(field, 500)
    answer = marched(relit, place, d)
    assert answer.sky.any()
    off = np.abs(answer.radiance / sky(d) - 1)[answer.sky]
    assert np.quantile(off, 0.9) < 0.02  # the rest mixes with the room at the roof's edge
