"""Planar reflectors at grazing angles: the light of the whole lobe, as path tracing has it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from lambent.core.views.camera import Camera, image_plane
from lambent.realtime.frame_state import FrameState
from lambent.realtime.integrators.albedo import gains
from lambent.realtime.integrators.patterns import lobe_points
from lambent.realtime.light.baked import Probe
from lambent.realtime.renderer import Renderer
from tests.realtime.test_realtime_planar import HEIGHT, WIDTH, mirror, scene_of


def test_a_floor_at_a_grazing_angle_shows_its_whole_lobe(device: Any) -> None:
    """Under one radiance, viewers at cosines of .04 to .07 see its albedo there; not less of it.

    Reference: the mean of f cos_i/pdf over half vectors of the lobe (`realtime.integrators.albedo`).
    """
    scene = scene_of(mirror(0.05))
    sky = np.ones((6, 4, 4, 3), np.float32)
    record = scene.record.model_copy(update={"objects": scene.record.objects[-1:]})
    renderer = Renderer(device, replace(scene, record=record, environment=sky, probes={"floor": Probe((0, 0, 0), sky)}))
    low = Camera(name="low", position=(0.0, 0.2, 2.9), target=(0.0, 0.1, 0.0), fov_y_deg=20)
    asked = FrameState(low, WIDTH, HEIGHT, antialias=False, integrator="rings", show="specular")
    image = renderer.image(asked)
    across, up, forward = image_plane(low, WIDTH, HEIGHT)
    x, y = np.meshgrid((np.arange(WIDTH) + 0.5) / WIDTH * 2 - 1, 1 - (np.arange(HEIGHT) + 0.5) / HEIGHT * 2)
    rays = forward + x[..., None] * across + y[..., None] * up
    cos_o = -rays[..., 1] / np.linalg.norm(rays, axis=-1)
    lobe = mirror(0.05).lobes[0]
    seen = (cos_o > 0.04) & (cos_o < 0.07)
    slopes = lobe_points(4096, lobe.distribution == "ggx") * lobe.mx
    albedo = gains(lobe, slopes, np.linspace(0.04, 0.07, 31))[1].mean(axis=1)
    expected = np.interp(cos_o[seen], np.linspace(0.04, 0.07, 31), albedo)
    assert seen.sum() > 500
    np.testing.assert_allclose(image[seen].mean(), expected.mean(), rtol=0.03)
