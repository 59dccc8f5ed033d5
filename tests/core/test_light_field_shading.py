"""Materials, refraction and turned surroundings from light fields."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from lambent.core.arrays import Floats
from lambent.core.directions import basis, normalize, reflect, rotation_about
from lambent.core.light_field import LightField
from lambent.core.light_field_lookup import Place, blended, marched
from lambent.core.light_field_shading import (
    refracted,
    scattered,
    scattered_by_points,
    shown,
    turned,
    under_sky,
)
from lambent.materials.bsdf import MaterialBSDF, cos_over_pdf
from lambent.materials.document import Lobe, Material
from tests.core.analytic_light_field import ball_field, places, sky_light

GLOSSY = Material(name="glossy", kd=(0.2, 0.3, 0.1), lobes=(Lobe(mx=0.1, my=0.3, r0=(0.6, 0.5, 0.4), alpha=0.5),))


@pytest.fixture(scope="module")
def field() -> LightField:
    return ball_field(144, 64, open_roof=True)


def scatter_of(material: Material, place: Place, wo: Floats, seed: int) -> Callable[[int], tuple[Floats, Floats]]:
    """Samples of the material's own distribution in world space, the same whenever they are asked for."""
    t, b = basis(place.n)
    frame = np.stack([t, b, place.n], axis=-1)
    local, bsdf = np.einsum("kij,ki->kj", frame, wo), MaterialBSDF(material)

    def sample(number: int) -> tuple[Floats, Floats]:
        u = np.random.default_rng([seed, number]).random((len(wo), 3))
        wi = bsdf.sample(local, u)
        weight = bsdf.eval(wi, local) * cos_over_pdf(wi, bsdf.pdf(wi, local))[:, None]
        return np.einsum("kij,kj->ki", frame, wi), weight

    return sample


def test_a_material_in_constant_surroundings_shows_its_albedo(field: LightField) -> None:
    constant = replace(field, radiance=np.full_like(field.radiance, 2.0), inverse_distance=0 * field.inverse_distance)
    place, w = places(constant, 40)
    wo = reflect(w, place.n)
    local = np.stack([np.sum(wo * a, axis=-1) for a in (*basis(place.n), place.n)], axis=-1)
    facing = local[:, 2] > 0.3
    scatter = scatter_of(GLOSSY, place, wo, 1)
    light = scattered(scatter, lambda d: blended(constant, place, d), 400)
    np.testing.assert_allclose(light[facing], 2 * MaterialBSDF(GLOSSY).albedo(local[facing]), rtol=0.12)
    assert light[facing].mean() == pytest.approx(2 * MaterialBSDF(GLOSSY).albedo(local[facing]).mean(), rel=0.02)


def test_both_orders_of_the_loops_agree_where_weights_do_not_follow_the_sample(field: LightField) -> None:
    place, w = places(field, 60)
    scatter = scatter_of(GLOSSY, place, reflect(w, place.n), 2)
    by_samples = scattered(scatter, lambda d: blended(field, place, d), 16)
    np.testing.assert_allclose(scattered_by_points(field, place, w, scatter, 16), by_samples, rtol=1e-10)
    by_points = scattered_by_points(field, place, w, scatter, 16, "reflection")
    followed = scattered(scatter, lambda d: blended(field, place, d, "reflection"), 16)
    assert np.abs(by_points - followed).max() > 1e-3


def test_a_narrow_lobe_is_a_mirror(field: LightField) -> None:
    mirror = Material(name="mirror", lobes=(Lobe(mx=1e-3, my=1e-3, r0=(1.0, 1.0, 1.0), alpha=0.5),))
    place, w = places(field, 200)
    cosine = np.sum(w * place.n, axis=-1)
    light = scattered(scatter_of(mirror, place, reflect(w, place.n), 3), lambda d: marched(field, place, d).radiance, 8)
    off = np.abs(light / marched(field, place, w).radiance - 1).max(axis=1)
    assert np.median(off[cosine > 0.3]) < 5e-3


def test_a_surface_under_a_mirror() -> None:
    np.testing.assert_allclose(shown(np.array([0.1, 0.2]), np.array([0.5, 1.0]), np.array([2.0, 3.0])), [1.1, 3.2])


def test_refraction_obeys_snell_in_and_out() -> None:
    n = np.tile([0.0, 0.0, 1.0], (50, 1))
    wo = normalize(np.random.default_rng(5).normal(size=(50, 3)))
    wo[:, 2] = np.abs(wo[:, 2])
    inside = refracted(wo, n, 1.5)
    np.testing.assert_allclose(np.linalg.norm(inside, axis=-1), 1, atol=1e-12)
    np.testing.assert_allclose(inside[:, :2], -wo[:, :2] / 1.5, atol=1e-12)
    assert (inside[:, 2] < 0).all()
    np.testing.assert_allclose(refracted(-inside, -n, 1.5), -wo, atol=1e-9)  # out through a parallel face: on its way
    grazing = normalize(np.array([[1.0, 0.0, -0.4]]))
    np.testing.assert_allclose(refracted(grazing, n[:1], 1.5), reflect(grazing, n[:1]), atol=1e-12)  # all is reflected
    np.testing.assert_allclose(refracted(wo, n, 1.0), -wo, atol=1e-12)


def test_a_turned_sky_is_seen_through_the_roof_alone(field: LightField) -> None:
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
