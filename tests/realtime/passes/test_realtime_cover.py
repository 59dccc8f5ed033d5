"""Thin geometry in motion: no gaps, the right brightness, and nothing changed elsewhere."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.core.light.colour import srgb_decode
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.shader_source import assemble
from lambent.realtime.objects.unbaked import unbaked_scene
from lambent.realtime.passes.cover import PLACES
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import patch

SIZE, PX_M, FAR_M = 64, 0.05, 10.0
SKY = 0.05
CAMERA = Camera(
    name="c", position=(0, 0, FAR_M), target=(0, 0, 0), fov_y_deg=2 * np.degrees(np.arctan(SIZE * PX_M / 2 / FAR_M))
)
MOTION = FrameState(CAMERA, SIZE, SIZE, view_transform="linear", near_m=0.1, covers=True)


def bar(device: Any, angle_deg: float, width_px: float, shift_px: float) -> Renderer:
    """A straight grey bar before a dark sky, as long as most of the image."""
    angle = np.radians(angle_deg)
    along, across = (np.array([np.cos(a), np.sin(a), 0]) for a in (angle, angle + np.pi / 2))
    length, width = 0.9 * SIZE * PX_M, width_px * PX_M
    corner = across * (shift_px * PX_M - width / 2) - along * length / 2
    mesh = patch(tuple(corner), tuple(along * length), tuple(across * width))
    grey = Material(name="grey", kd=(0.6, 0.6, 0.6))
    environment = np.full((6, 8, 8, 3), SKY, np.float32)
    return Renderer(device, unbaked_scene({"bar": mesh}, grey, environment, irradiance=(2.5, 2.5, 2.5)))


def light(encoded: np.ndarray) -> np.ndarray:
    """What a display adds to the sky, (SIZE, SIZE)."""
    emitted = np.asarray(srgb_decode(encoded[..., 1] / np.float32(255)), float)
    return emitted - emitted[0, 0]


@pytest.mark.long
@pytest.mark.parametrize("angle_deg", [10.0, 45.0])
def test_slanted_wires_keep_their_light(device: Any, angle_deg: float) -> None:
    """A wire of three tenths of a pixel that moves by tenths: no step takes its light away or doubles it."""
    shown = [light(bar(device, angle_deg, 0.3, shift).display_image(MOTION)) for shift in (0.03, 0.13, 0.33)]
    truth = light(bar(device, angle_deg, 0.3, 0.03).still(MOTION, 64)).sum()
    np.testing.assert_allclose([image.sum() / truth for image in shown], 1, atol=0.1)


@pytest.mark.long
@pytest.mark.parametrize("angle_deg", [0.0, 90.0])
def test_upright_and_level_wires_are_lines_wherever_they_lie(device: Any, angle_deg: float) -> None:
    """One or two of five places see them: within two fifths of the truth, and the same all along the wire."""
    truth, once = light(bar(device, angle_deg, 0.3, 0.03).still(MOTION, 64)).sum(), 0
    for shift in (0.03, 0.13, 0.43, 0.73):
        renderer = bar(device, angle_deg, 0.3, shift)
        image = light(renderer.display_image(MOTION))
        assert abs(image.sum() / truth - 1) < 0.4
        profile = image.sum(axis=0 if angle_deg == 0 else 1)[8:-8]
        np.testing.assert_allclose(profile, profile.mean(), rtol=0.02)
        once += light(renderer.display_image(replace(MOTION, antialias=False))).sum() > 0
    assert once <= 2, "a single sample sees the wire as often: nothing is tested"


def test_a_broad_edge_is_as_bright_as_in_a_still(device: Any) -> None:
    renderer, state = bar(device, 20.0, 12.3, 0.2), replace(MOTION, view_transform="filmic")
    moving, truth = (light(image) for image in (renderer.display_image(state), renderer.still(state, 64)))
    once = light(renderer.display_image(replace(state, antialias=False)))
    assert moving.sum() == pytest.approx(truth.sum(), rel=0.01)
    assert np.abs(moving - truth).mean() < 0.45 * np.abs(once - truth).mean()


def test_pictures_at_rest_and_flat_surfaces_stay(device: Any) -> None:
    renderer = bar(device, 20.0, 200.0, 0.2)  # fills the middle of the image
    covered = renderer.display_image(MOTION)
    inside = np.s_[16:-16, 16:-16]
    np.testing.assert_array_equal(covered[inside], renderer.display_image(replace(MOTION, antialias=False))[inside])
    assert renderer.draw(replace(MOTION, accumulate=0)).format == "rgba32float"


def test_places_are_those_of_the_shader() -> None:
    text = re.search(r"PLACES = array<vec2f, 4>\((.*)\);", assemble("places.wgsl"))
    assert text is not None
    found = re.findall(r"vec2f\(([-\d.]+), ([-\d.]+)\)", text[1])
    np.testing.assert_array_equal(np.array(found, float), PLACES)
    lattice = np.array([(0, 0), *PLACES])
    for direction in ((1, 0), (0, 1), (1, 1), (1, -1)):
        np.testing.assert_allclose(np.sort(lattice @ direction % 1), np.arange(5) / 5, atol=1e-9)
