"""Emitters without the sun, as the light map's points sample them: the same light, with less noise."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from lambent.baking.sky.daylight import radiance_from
from lambent.baking.sky.sun import sun_of
from lambent.baking.tracing import path_tracer
from lambent.baking.tracing.first_light import FirstLight, sky_without
from lambent.baking.tracing.lights.emitters import balance_emitters
from lambent.baking.tracing.lights.sun import Sun
from lambent.baking.tracing.rays import array_of, independent, vectors
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.geometry.directions import normalize
from lambent.scenes.geometry import patch
from lambent.scenes.scene import DirectionalLight, PointLight, Scene, SceneObject
from tests.baking.sky.test_sun import SKY, TOWARDS, disc, environment_file, suns, wall_with_an_opening
from tests.baking.small_scenes import BLACK, GREY
from tests.baking.tracing.facing_up import facing_up, irradiance

pytestmark = pytest.mark.usefixtures("mi")


def traced_scene(scene: Scene) -> tuple[mi.Scene, Sun, Sun]:
    """The whole scene, and its sun without and with the emitters that points sample instead."""
    found = sun_of(scene)
    assert found is not None
    builder = SceneBuilder(scene)
    balance_emitters(builder)
    whole = builder.build()
    first = FirstLight(builder, whole, found, sky_without(found, builder, whole))
    return whole, Sun(found), Sun(found, first)


def lamps() -> tuple[SceneObject, PointLight, DirectionalLight]:
    glowing = SceneObject("glowing", patch((-0.5, 1.2, 0.5), (0, 0, -1), (1, 0, 0)), "grey", (1.0, 2.0, 3.0))
    return glowing, PointLight((1.5, 1.0, 1.0), (1.0, 1.0, 1.0)), DirectionalLight((1.0, -2.0, 0.3), (0.1, 0.2, 0.1))


@pytest.mark.long
@pytest.mark.parametrize("number, others", [(0, False), (1, True)])
def test_points_get_the_same_light_with_less_noise(tmp_path: Path, number: int, others: bool) -> None:
    scene = suns(tmp_path)[number]
    if others:
        glowing, *lights = lamps()
        scene = replace(scene, objects=(*scene.objects, glowing), lights=(*scene.lights, *lights))
    whole, plain, beside = traced_scene(scene)
    rng, count = np.random.default_rng(number), 1 << 16
    p = np.column_stack([rng.uniform(-2, 2, count), np.zeros(count), rng.uniform(-2, 2, count)])
    points = facing_up(p)
    former, found = irradiance(whole, points, 1, 3, plain), irradiance(whole, points, 2, 3, beside)
    error = np.sqrt((former.var(axis=0) + found.var(axis=0)) / count)
    assert np.all(np.abs(found.mean(axis=0) - former.mean(axis=0)) < 4 * error)
    if not others:
        assert found.var(axis=0).sum() < 0.9 * former.var(axis=0).sum()


@pytest.mark.long
def test_sky_has_no_sun_and_lamps_stay(tmp_path: Path) -> None:
    glowing, point, weak = lamps()
    environment = environment_file(tmp_path, disc(TOWARDS, 2.0, 1000.0))
    objects = (*wall_with_an_opening(), glowing)
    scene = Scene("both", objects, {"grey": GREY}, environment, (point, weak))
    _, _, beside = traced_scene(scene)
    assert beside.first is not None
    sky = beside.first.scene.environment()
    about = np.array(beside.record.direction)
    w = normalize(about + 0.06 * np.random.default_rng(0).normal(size=(20000, 3)))
    assert np.allclose(radiance_from(sky, w), 2 * np.array(SKY), rtol=0.02)
    assert len(beside.first.scene.emitters()) == 4
    directional = replace(scene, environment=None, lights=(weak, DirectionalLight((0.0, -1.0, 0.0), (9.0, 9.0, 9.0))))
    found = traced_scene(directional)[2].first
    assert found is not None and len(found.scene.emitters()) == 2, "the weak light and the one that glows"


def test_a_scene_of_the_sun_alone_is_dark() -> None:
    light = DirectionalLight(tuple(-TOWARDS), (3.0, 2.0, 1.0))
    whole, _, beside = traced_scene(Scene("sun", wall_with_an_opening()[:1], {"grey": BLACK}, lights=(light,)))
    up = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    points = path_tracer.Points(*(vectors(mi.Vector3f, v) for v in (0 * up + 0.3, up, up)))
    sampler = independent(0, 2)
    value = path_tracer.irradiance(whole, sampler, points, sampler.next_2d(), sampler.next_2d(), 3, None, beside)
    assert not array_of(value).any()
