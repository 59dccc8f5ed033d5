"""Diffuse light of scenes without a bake: known answers under an even sky and under half of one."""

from dataclasses import replace

import numpy as np
import pytest

from lambent.core.geometry.cubemap import face_directions
from lambent.core.geometry.directions import normalize
from lambent.materials.document import Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.objects.unbaked import CAMERA, irradiance, unbaked_scene, with_diffuse_light
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import patch, sphere
from lambent.scenes.sky.environments import daylight

EVEN = np.full((6, 32, 32, 3), 0.5, np.float32)
ABOVE = np.where(normalize(face_directions(32))[..., 1:2] > 0, np.ones(3), np.zeros(3)).astype(np.float32)


def test_irradiance_of_an_even_and_of_half_a_sky():
    """pi L everywhere; and pi L (1 + n_y)/2 under the upper half, which a coarse cube meets within a few percent."""
    n = normalize(np.array([[0, 1, 0], [0, -1, 0], [1, 0, 0], [1, 1, 1], [0.3, -0.8, 0.2]], float))
    assert irradiance(EVEN, n) == pytest.approx(0.5 * np.pi, rel=0.01)
    assert irradiance(ABOVE, n)[:, 0] == pytest.approx(np.pi * (1 + n[:, 1]) / 2, abs=0.05)


def test_a_white_sphere_under_an_even_sky_cannot_be_seen(device):
    white = Material(name="white", kd=1.0)
    scene = with_diffuse_light(unbaked_scene({"ball": sphere(0.8, 24, 12)}, white, EVEN))
    image = Renderer(device, scene).image(FrameState(CAMERA, 64, 64, integrator="diffuse"))
    assert image == pytest.approx(0.5, rel=0.02)


def test_light_comes_through_a_sheet(device):
    """A level sheet under half a sky, seen from below: kt_d of the light above."""
    sheet = patch((-1, 0, 1), (2, 0, 0), (0, 0, -2))  # faces up
    below = replace(CAMERA, position=(0.0, -3.0, 0.01), fov_y_deg=20.0)
    for material, expected in (
        (Material(name="m", kt_d=(0.4, 0.2, 0.1)), (0.4, 0.2, 0.1)),
        (Material(name="m", kd=0.5), (0,) * 3),
    ):
        scene = with_diffuse_light(unbaked_scene({"sheet": sheet}, material, ABOVE))
        image = Renderer(device, scene).image(FrameState(below, 16, 16, integrator="diffuse"))
        assert image[8, 8] == pytest.approx(expected, abs=0.02)


def test_daylight_comes_from_its_sun():
    sun = normalize(np.array([0.45, 0.62, 0.64]))
    sky = daylight(64, tuple(sun))
    w = normalize(face_directions(64))
    assert np.isfinite(sky).all() and (sky >= 0).all()
    brightest = w.reshape(-1, 3)[sky.sum(axis=-1).argmax()]
    assert brightest @ sun > np.cos(np.radians(2))
    zenith, ground = sky[2, 32, 32], sky[3, 32, 32]
    assert zenith[2] > zenith[0], "the sky is blue"
    assert np.ptp(sky[3].reshape(-1, 3), axis=0).max() == 0, "the ground is even"
    across = irradiance(sky, np.stack([sun, -sun]))
    assert across[0].min() > 3 * across[1].max() and ground.min() > 0


def test_a_series_begins_anew_after_a_frame_of_another_size(device):
    """As the window does it: few pixels while a slider moves, then a series at full size, of the new material."""
    scene = with_diffuse_light(unbaked_scene({"ball": sphere(0.8, 24, 12)}, Material(name="m"), EVEN))
    renderer = Renderer(device, scene)
    for step in range(3):
        materials = {"m": Material(name="m", kd=step / 3)}
        renderer.draw(FrameState(CAMERA, 16, 16, integrator="diffuse", materials=materials))
        mean = renderer.converged(FrameState(CAMERA, 64, 64, n=1, materials=materials), 2)
        assert mean[32, 32] == pytest.approx(step / 3 * 0.5, abs=0.01), f"step {step}"
