"""Cameras: axes for every view, rays and projection that agree, one overview."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.core.views.camera import Camera, camera_axes, clip_from_world, overview, pixel_rays, rays_through

OBLIQUE = Camera("oblique", (1.5, 0.8, 2.0), (0.2, 0.1, 0.0), fov_y_deg=50.0)
ODD = (
    OBLIQUE,
    replace(OBLIQUE, up=(0.3, 1.0, -0.2)),
    Camera("down", (0, 3, 0), (0, 0, 0)),  # up is parallel to the view
    Camera("along z", (0, 0, 2), (0, 0, 0), up=(0, 0, 1)),
    Camera("no up", (0, 1, 2), (0, 1, 0), up=(0, 0, 0)),
    Camera("on its target", (1, 1, 1), (1, 1, 1)),
)


@pytest.mark.parametrize("camera", ODD, ids=lambda camera: camera.name)
def test_axes_are_a_right_handed_frame(camera: Camera) -> None:
    right, up, forward = axes = np.array(camera_axes(camera))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(np.cross(right, up), -forward, atol=1e-12)  # y up, looking along -z, x is right


@pytest.mark.parametrize("camera", ODD, ids=lambda camera: camera.name)
def test_rays_are_distinct_and_project_to_their_pixels(camera: Camera) -> None:
    width, height = 7, 5
    rays = pixel_rays(camera, width, height)
    assert len(np.unique(rays.reshape(-1, 3).round(9), axis=0)) == width * height
    points = np.concatenate([np.asarray(camera.position) + 3 * rays, np.ones((height, width, 1))], axis=-1)
    clip = points @ clip_from_world(camera, width, height, 0.01).T
    x, y = np.moveaxis(clip[..., :2] / clip[..., 3:], -1, 0)
    np.testing.assert_allclose((x + 1) / 2 * width, np.arange(width)[None, :] + 0.5 + 0 * y, atol=1e-9)
    np.testing.assert_allclose((1 - y) / 2 * height, np.arange(height)[:, None] + 0.5 + 0 * x, atol=1e-9)


def test_the_middle_of_the_image_is_straight_ahead() -> None:
    np.testing.assert_allclose(rays_through(OBLIQUE, 80, 45, 160, 90), camera_axes(OBLIQUE)[2], atol=1e-12)


def test_an_overview_sees_every_corner() -> None:
    low, high = np.array([-3.0, 0.0, -1.0]), np.array([5.0, 2.5, 9.0])
    corners = np.array([[*np.where(pick, high, low), 1] for pick in np.ndindex(2, 2, 2)])
    clip = corners @ clip_from_world(overview(low, high), 100, 100, 0.01).T
    assert (clip[:, 3] > 0).all() and (np.abs(clip[:, :2]) <= clip[:, 3:]).all()
