"""Look-ups of light fields: weights, constant surroundings, and a room that is known by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.baked.light_fields import maps as light_field_maps
from lambent.baked.light_fields.light_field import NO_POINT, LightField
from lambent.baked.light_fields.lookup import March, blended, marched, normal_weights
from lambent.baked.light_fields.maps import nearest_points, radiance_along, whole_texels
from lambent.baked.light_fields.shading import turned, under_sky
from lambent.core.geometry.directions import normalize, rotation_about
from lambent.core.geometry.octahedral import bordered, texel_directions, to_square
from tests.baked.light_fields.analytic_light_field import ball_field, errors, places, seen, sky_light


@pytest.fixture(scope="module")
def field() -> LightField:
    return ball_field()


@pytest.fixture(scope="module")
def roofless() -> LightField:
    return ball_field(open_roof=True)


def test_texels_are_interpolated_over_the_edges_of_the_map(field: LightField) -> None:
    w = normalize(np.random.default_rng(1).normal(size=(3000, 3)))
    point = np.random.default_rng(2).integers(len(field.points), size=3000)
    wide, n = bordered(field.radiance.astype(float), 1), field.radiance.shape[1]
    at = to_square(w) * n + 0.5
    low = at.astype(int)
    share = (at - low)[..., None]
    (column, row), (u, v) = low.T, (share[:, 0], share[:, 1])
    upper = wide[point, row, column] * (1 - u) + wide[point, row, column + 1] * u
    lower = wide[point, row + 1, column] * (1 - u) + wide[point, row + 1, column + 1] * u
    np.testing.assert_allclose(radiance_along(field, point, 5 * w), upper * (1 - v) + lower * v, rtol=1e-6)


def test_the_sky_has_its_share_of_texels_that_show_both() -> None:
    """By the quarters that surfaces cover; none of them is a texel of the sky itself."""
    field = replace(
        ball_field(1, 4), radiance=np.full((1, 4, 4, 3), 2.0), cover=np.arange(16, dtype=np.uint8).reshape(1, 4, 4)
    )
    share = np.array([0, 3, 3, 2, 3, 2, 2, 1, 3, 2, 2, 1, 2, 1, 1, 0]) / 4
    expected = np.repeat(2 + share[:, None] * (10 - 2), 3, axis=1)
    w = texel_directions(4).reshape(-1, 3)
    found = radiance_along(field, np.zeros(16, int), w, lambda w: np.full(w.shape, 10.0))
    np.testing.assert_allclose(found, expected)
    whole = whole_texels(field.radiance, field.cover, lambda w: np.full(w.shape, 10.0))
    np.testing.assert_allclose(whole.reshape(16, 3), expected)


def test_a_sample_map_is_cropped_from_its_grid(field: LightField) -> None:
    cropped = replace(field, sample_map=field.sample_map[10:20, 30:50], corner=(10, 30))
    uv2 = np.random.default_rng(4).uniform((31 / 96, 11 / 48), (49 / 96, 19 / 48), (500, 2))
    np.testing.assert_array_equal(nearest_points(cropped, uv2), nearest_points(field, uv2))
    outside = nearest_points(cropped, np.array([[0.0, 0.0], [1.0, 1.0], [-3.0, 8.0]]))
    np.testing.assert_array_equal(outside[:2], field.sample_map[[10, 19], [30, 49]])


def test_constant_surroundings_are_what_the_march_returns(field: LightField) -> None:
    constant = replace(field, radiance=np.full_like(field.radiance, 0.75), inverse_distance=0 * field.inverse_distance)
    place, w = places(field)
    answer = marched(constant, place, w)
    np.testing.assert_allclose(answer.radiance, 0.75, rtol=1e-12)
    assert answer.sky.all() and not answer.met.any()


def test_a_march_meets_the_walls_where_the_ray_does(field: LightField) -> None:
    place, w = places(field)
    uncorrected = errors(blended(field, place, w, normal_weights(field, place)), place, w)
    for count, met in ((1, 0.98), (4, 0.998)):
        answer = marched(field, place, w, March(candidates=count))
        assert answer.met.mean() > met
        distance = seen(place.x + 1e-7 * place.n, w)[1]
        off = np.abs(answer.distance_m / distance - 1)[answer.met]
        assert np.median(off) < 0.01 and np.quantile(off, 0.99) < 0.05
        error = errors(answer.radiance, place, w)
        assert np.median(error) < 0.03 * np.median(uncorrected)
        assert np.sqrt((error**2).mean()) < (0.9 if count == 1 else 0.5) * np.sqrt((uncorrected**2).mean())


def test_the_march_errs_by_texels_and_a_blend_by_the_spacing_of_points(field: LightField) -> None:
    def median(of: LightField, method: str) -> float:
        place, w = places(of)
        answer = (
            marched(of, place, w).radiance if method == "march" else blended(of, place, w, normal_weights(of, place))
        )
        return float(np.median(errors(answer, place, w)))

    coarse, sparse = ball_field(144, 80), ball_field(36, 80)
    assert median(field, "march") < 0.5 * median(coarse, "march")
    # closer points add sharpness alone: more of them agree, so that one has a texel near each hit
    assert median(sparse, "march") == pytest.approx(median(coarse, "march"), rel=0.4)
    assert median(field, "normal") > 0.9 * median(coarse, "normal")
    assert median(sparse, "normal") > 1.5 * median(coarse, "normal")


def test_points_that_have_a_texel_near_the_hit_blur_it_least(
    field: LightField, monkeypatch: pytest.MonkeyPatch
) -> None:
    place, w = places(field, 4000)
    focused = float(np.median(errors(marched(field, place, w).radiance, place, w)))
    monkeypatch.setattr(light_field_maps, "FOCUS", 0.0)
    assert focused < 0.92 * float(np.median(errors(marched(field, place, w).radiance, place, w)))


def test_light_that_one_point_alone_sees_on_a_surface_is_left_out(field: LightField) -> None:
    """A highlight in the direction of every fourth point; two of the four points of a place may have one."""
    place, w = places(field, 4000)
    bright = replace(field, radiance=np.where(np.arange(144)[:, None, None, None] % 4 == 0, 50.0, field.radiance))
    plain, found = (marched(one, place, w) for one in (field, bright))
    lone = found.met & ((place.points % 4 == 0).sum(axis=1) == 1)
    assert lone.sum() > 500
    kept = np.abs(found.radiance - plain.radiance).max(axis=1)[lone] < 0.3
    assert kept.mean() > 0.9, kept.mean()


def test_the_sky_is_read_where_all_points_see_it(roofless: LightField) -> None:
    place, w = places(roofless)
    start = place.x + 1e-7 * place.n
    sky = ~np.isfinite(seen(start, w, open_roof=True)[1])
    answer = marched(roofless, place, w, sky=sky_light)
    assert (answer.sky == sky).mean() > 0.97
    agreed = answer.sky & sky
    np.testing.assert_array_equal(answer.radiance[agreed], sky_light(w)[agreed])
    walls = errors(answer.radiance, place, w, answer.met & ~sky, open_roof=True)
    assert np.median(walls) < 0.01


def test_texels_of_the_object_itself_are_not_met_beside_the_place(field: LightField) -> None:
    """Nothing is near a ball, and rays that graze its coarse texels hardly meet it: .069 did by the distance alone."""
    coarse = ball_field(144, 64)
    place, w = places(coarse, 4000)
    w = normalize(w - 0.8 * np.sum(w * place.n, axis=-1, keepdims=True) * place.n)  # nearer to the horizon
    answer = marched(coarse, place, w)
    false = answer.met & (answer.distance_m < 0.5 * seen(place.x + 1e-7 * place.n, w)[1])
    assert false.mean() < 0.064
    assert answer.met.mean() > 0.97


def test_places_without_points_are_black_and_finite(field: LightField) -> None:
    place, w = places(field, 50)
    nowhere = replace(place, points=np.full_like(place.points, NO_POINT))
    answer = marched(field, nowhere, w, sky=sky_light)
    assert not answer.met.any() and not answer.sky.any()
    np.testing.assert_array_equal(answer.radiance, 0)


@pytest.mark.long
def test_quarters_of_texels_sharpen_the_edge_of_a_roof() -> None:
    """So the error over all directions falls."""
    field = ball_field(144, 96, open_roof=True)
    light, fine = seen(field.points.astype(float)[:, None, None], texel_directions(192), open_roof=True)
    quarters = np.isfinite(fine).reshape(144, 96, 2, 96, 2).transpose(0, 1, 3, 2, 4).reshape(144, 96, 96, 4)
    near = np.where(np.isfinite(fine), 1 / fine, 0).reshape(144, 96, 2, 96, 2).sum(axis=(2, 4))
    mean = near / np.maximum(quarters.sum(axis=-1), 1)
    inverse = np.where(field.inverse_distance > 0, field.inverse_distance, mean).astype(np.float16)
    of_walls = (light * np.isfinite(fine)[..., None]).reshape(144, 96, 2, 96, 2, 3).sum(axis=(2, 4))
    of_walls /= np.maximum(quarters.sum(axis=-1), 1)[..., None]
    mixed = (field.inverse_distance == 0) & (inverse > 0)
    radiance = np.where(mixed[..., None], of_walls, field.radiance)
    cover = (quarters * [1, 2, 4, 8]).sum(axis=-1).astype(np.uint8)
    place, w = places(field, 6000)
    found = [
        errors(marched(one, place, w, sky=sky_light).radiance, place, w, open_roof=True)
        for one in (field, replace(field, radiance=radiance, inverse_distance=inverse, cover=cover))
    ]
    plain, covered = (float(np.sqrt(np.mean(e**2))) for e in found)
    assert covered < 0.89 * plain, (covered, plain)  # .92 if edges are where any of four points sees them


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
