"""Numbers of the light map that pictures hide: noise, samples taken, the sum of directions, where the sun stands."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.engine import engine
from lambent.baking.light.sampling import relative_noise
from lambent.core.geometry.directions import basis, normalize
from lambent.core.light.colour import luminance
from lambent.materials.bsdf import under_fresnel
from lambent.materials.document import Material
from lambent.scenes.scene import DirectionalLight, SunSky
from tests.baking.small_scenes import TINY, furnace, plane


def test_noise_is_half_the_difference_over_the_mean() -> None:
    """Two estimates of 2 that are .2 apart have a mean whose standard error is .1, 5 %."""
    halves = np.stack([np.full((4, 4, 3), 2.1), np.full((4, 4, 3), 1.9)])
    assert relative_noise(halves) == pytest.approx(0.05)
    share = np.zeros((4, 4))
    share[0, 0] = 1
    halves[:, 0, 0] = [[3.0] * 3, [1.0] * 3]
    assert relative_noise(halves, share) == pytest.approx(0.5), "of the texel that counts"


def test_the_least_samples_are_enough_where_they_are_exact_enough(tmp_path: Path) -> None:
    quality = TINY.changed(light_map={"samples": (8, 64), "noise": 10.0})
    traced = bake(furnace(), tmp_path / "s", quality=quality, only=("light_map",)).read("light_map/traced")
    assert traced[..., 3].sum(axis=0).max() == 8


def test_directions_are_weighted_by_luminance(tmp_path: Path) -> None:
    """Suns of pure colours: the sum of their directions, each times cos and Y."""
    engine()
    import drjit as dr
    import mitsuba as mi

    from lambent.baking.tracing import path_tracer
    from lambent.baking.tracing.rays import array_of, independent
    from lambent.baking.tracing.scene_builder import SceneBuilder

    suns = [(normalize(np.array(w, float)), np.array(e)) for w, e in (
        ((0.6, 0.8, 0.0), (3.0, 0, 0)), ((0.0, 0.6, 0.8), (0, 2.0, 0)), ((-0.8, 0.6, 0.0), (0, 0, 9.0)))
    ]  # fmt: skip
    scene = plane()
    lights = tuple(DirectionalLight(tuple(-w), tuple(e)) for w, e in suns)
    built = SceneBuilder(replace(scene, lights=lights)).build()
    n = 3000
    up = mi.Vector3f(0, 1, 0) + dr.zeros(mi.Vector3f, n)
    points = path_tracer.Points(dr.zeros(mi.Point3f, n), up, up)
    sampler = independent(1, n)
    found = path_tracer.moment(built, sampler, points, sampler.next_2d(), sampler.next_2d(), 1)
    expected = sum(luminance(e) * w[1] * w for w, e in suns)
    mean, spread = array_of(found).mean(axis=0), array_of(found).std(axis=0) / np.sqrt(n)
    assert np.all(np.abs(mean - expected) < 4 * spread + 1e-3)
    assert np.all(spread < 0.05)


def test_the_sun_stands_where_it_is_said_to() -> None:
    """Centre of the light of the disc, within .03 degrees; a pixel of the sky's image is .18 degrees."""
    engine()
    from lambent.baking.sky.daylight import lone_emitter, radiance_from
    from lambent.baking.tracing.scene_builder import environment_dict

    sun = normalize(np.array([0.5, 0.6, -0.4]))
    sky = lone_emitter(environment_dict(SunSky(tuple(sun))))
    t, b = basis(sun[None])
    angle = np.radians(np.linspace(-1.2, 1.2, 241))
    x, y = (a.ravel() for a in np.meshgrid(angle, angle))
    light = radiance_from(sky, normalize(sun + x[:, None] * t + y[:, None] * b))[:, 1]
    light = np.where(light > 0.02 * light.max(), light, 0)
    off = np.degrees([light @ x / light.sum(), light @ y / light.sum()])
    assert np.abs(off).max() < 0.03


def test_a_coupled_diffuse_reflectance_falls_with_the_viewers_cosine() -> None:
    engine()
    import mitsuba as mi

    from lambent.baking.bsdfs.material_plugin import material_dict, register_material_plugin
    from tests.tools.in_mitsuba import interaction

    register_material_plugin()
    w = normalize(np.array([[0.0, 0.0, 1.0], [0.9, 0.1, 0.3], [0.9, 0.1, -0.3]]))
    for coupled in (True, False):
        bsdf = mi.load_dict(material_dict(Material(kd=(0.2, 0.4, 0.6), kd_coupled=coupled)))
        found = np.array(bsdf.eval_diffuse_reflectance(interaction(w))).T
        factor = under_fresnel(np.abs(w[:, 2:])) if coupled else np.ones((3, 1))
        np.testing.assert_allclose(np.broadcast_to(found, (3, 3)), factor * [0.2, 0.4, 0.6], rtol=1e-4)
