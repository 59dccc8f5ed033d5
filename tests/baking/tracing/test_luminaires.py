"""Lamps in photometric units: what they throw on a surface, by Mitsuba, the light map's paths and photons, by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from lambent.baking.bake import bake
from lambent.core.light.photometry import LM_PER_W, photometric
from lambent.scenes.photometry.distribution import Photometry
from lambent.scenes.scene import DirectionalLight, IesLight, PointLight
from lambent.scenes.sky.triangle_lights import joined, small_lights
from tests.baking.small_scenes import TINY, plane
from tests.scenes.loaders.gltf.test_gltf import document, loaded

VERTICAL, HORIZONTAL = (0.0, 20.0, 33.3, 60.0, 90.0), (0.0, 90.0, 180.0, 290.0, 360.0)
CANDELA = tuple(tuple(100.0 * (1 + k) / (1 + j) for j in range(5)) for k in (0, 1, 2, 3, 0))
LAMP = Photometry(VERTICAL, HORIZONTAL, CANDELA)
W_SR = (1 / LM_PER_W,) * 3


def illuminance(light: IesLight, points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """lx on a surface at points (n, 3), from the luminaire's own definition."""
    to = points - light.position
    metres = np.linalg.norm(to, axis=1)
    x, y, z = ((to / metres[:, None]) @ axis for axis in light.axes)
    cd = light.photometry.at(np.degrees(np.arccos(np.clip(z, -1, 1))), np.degrees(np.arctan2(y, x)))
    return cd * np.maximum(-(to @ normal), 0) / metres**3


@pytest.mark.parametrize("aim", [(0.0, -1.0, 0.0), (0.48, 0.64, 0.6)])
def test_a_luminaire_shines_as_its_file_says(mi: Any, aim: tuple[float, float, float]) -> None:
    from lambent.baking.tracing.rays import array_of, vectors
    from lambent.baking.tracing.scene_builder import emitter_of

    light = IesLight((0.1, 2.0, -0.2), LAMP, W_SR, aim, rotation_deg=25.0)
    np.testing.assert_allclose(light.axes @ light.axes.T, np.eye(3), atol=1e-12)
    rng = np.random.default_rng(1)
    points = rng.normal(0, 2, (2000, 3))
    it = mi.SurfaceInteraction3f()
    it.p = vectors(mi.Point3f, points)
    normal = np.array([0.0, 1.0, 0.0])
    ds, light_here = emitter_of(light).sample_direction(it, mi.Point2f(0.5), True)
    got = photometric(array_of(light_here) * np.maximum(array_of(ds.d) @ normal, 0)[:, None])
    np.testing.assert_allclose(got, illuminance(light, points, normal), rtol=1e-3, atol=1e-3)


def test_lights_of_edited_views_shine_as_their_own_files_say(mi: Any) -> None:
    from lambent.baking.tracing.rays import array_of, vectors
    from lambent.baking.transport.device_lights import light_at, lights_on_device

    narrow = Photometry((10.0, 40.0), (0.0, 180.0, 360.0), ((900.0, 300.0), (100.0, 0.0), (900.0, 300.0)))
    first = IesLight((0.1, 2.0, -0.2), LAMP, W_SR, (0.6, -0.8, 0.0), 25.0)
    second = IesLight((-1.0, 1.0, 0.5), narrow, W_SR, (0.0, 1.0, 0.0), 70.0)
    sun, lamp = DirectionalLight((0.0, -1.0, 0.0), (2.0, 2.0, 2.0)), PointLight((0.0, 1.0, 0.0), (3.0, 3.0, 3.0))
    lights = joined([small_lights([sun, first]), small_lights([lamp, second])])
    assert lights.luminaires == {1: first, 3: second} and lights.near.tolist() == [False, True, True, True]
    points = np.random.default_rng(1).normal(0, 2, (4000, 3))
    on_device, up = lights_on_device(lights), np.array([0.0, 1.0, 0.0])
    for m, light_here, normal in ((1, first, up), (3, second, -up)):
        expected = illuminance(light_here, points, normal)
        towards, _, _, _, light, share, _ = light_at(on_device, mi.UInt32(m), vectors(mi.Point3f, points))
        got = photometric(array_of(light * share) * np.maximum(array_of(towards) @ normal, 0)[:, None])
        assert (expected > 0).sum() > 100
        np.testing.assert_allclose(got, expected, rtol=2e-3, atol=1e-3 * expected.max())
    share = np.array(light_at(on_device, mi.UInt32(2), vectors(mi.Point3f, points))[5])
    np.testing.assert_allclose(share, 1 / ((points - lamp.position) ** 2).sum(axis=1), rtol=1e-4)


def test_its_rays_carry_its_flux_where_it_shines(mi: Any) -> None:
    from lambent.baking.tracing.rays import array_of, independent
    from lambent.baking.tracing.scene_builder import emitter_of

    light = IesLight((0.0, 0.0, 0.0), LAMP, W_SR, (0.6, -0.8, 0.0), 40.0)
    sampler = independent(3, 400_000)
    ray, power = emitter_of(light).sample_ray(0.0, 0.0, sampler.next_2d(), sampler.next_2d(), True)
    lumens, w = photometric(array_of(power)), array_of(ray.d)
    assert lumens.mean() == pytest.approx(LAMP.lumens, rel=0.005)
    assert lumens.std() < 0.5 * lumens.mean(), "drawn nearly in proportion to the intensity"
    toward = w @ light.axes.T
    theta, phi = np.degrees(np.arccos(np.clip(toward[:, 2], -1, 1))), np.degrees(np.arctan2(toward[:, 1], toward[:, 0]))
    for low, high in ((0, 20), (20, 60), (60, 90)):
        x = np.radians(np.linspace(low, high, 400))
        y = np.linspace(0, 360, 721)[:-1]
        expected = (LAMP.at(np.degrees(x)[:, None], y[None]) * np.sin(x)[:, None]).mean() * (x[-1] - x[0]) * 2 * np.pi
        mine = np.where((theta >= low) & (theta < high), lumens, 0)
        assert mine.mean() == pytest.approx(expected, rel=0.03)
    assert np.where(phi > 0, lumens, 0).mean() != pytest.approx(lumens.mean() / 2, rel=0.05), "not even around"


@pytest.mark.parametrize("method", ["paths", "photons"])
def test_a_light_map_under_a_luminaire(mi: Any, tmp_path: Path, method: str) -> None:
    light = IesLight((0.1, 1.0, 0.0), LAMP, W_SR)
    scene = replace(plane(), lights=(light,))
    store = bake(scene, tmp_path / "s", quality=TINY, only=("light_map",), light_map=method)
    grid = (np.arange(200) + 0.5) / 100 - 1
    x, z = (a.ravel() for a in np.meshgrid(grid, grid))
    corners, uv = store.read("geometry/positions")[:, [0, 2]], store.read("geometry/uv2")
    of_place = np.linalg.lstsq(np.c_[corners, np.ones(len(corners))], uv, rcond=None)[0]
    lux = photometric(store.read("light_map/irradiance").astype(float))
    column, row = (np.c_[x, z, np.ones(len(x))] @ of_place * lux.shape[::-1] - 0.5).T
    found = map_coordinates(lux, [row, column], order=1, mode="nearest")
    expected = illuminance(light, np.stack([x, 0 * x, z], axis=1), np.array([0.0, 1.0, 0.0]))
    assert found.mean() == pytest.approx(expected.mean(), rel=0.03)
    assert np.percentile(found, 80) == pytest.approx(np.percentile(expected, 80), rel=0.06)


def test_a_gltf_light_of_1000_cd_gives_1000_lx_at_a_metre(mi: Any, tmp_path: Path) -> None:
    content = document(
        nodes=[
            {"mesh": 0, "scale": [0.02, 0.02, 0.02]},
            {"translation": [0, 0, 1], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
        scenes=[{"nodes": [0, 1]}],
        extensions={"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 1000}]}},
    )
    scene = replace(loaded(tmp_path, content), environment=None)
    store = bake(scene, tmp_path / "s", quality=TINY, only=("light_map",))
    lx = photometric(store.read("light_map/irradiance").astype(float))
    assert lx[lx > 0] == pytest.approx(1000, rel=0.01) and (lx > 0).sum() > 10
