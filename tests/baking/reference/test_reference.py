"""Path traced pictures: the camera model, known radiance, variance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.baking.reference.path_traced import render_reference
from lambent.core.views.camera import Camera
from lambent.scenes.geometry import patch
from lambent.scenes.scene import Scene, SceneObject
from tests.baking.small_scenes import BLACK, furnace


def lamp(name: str, centre: tuple[float, float], half: float, colour: tuple[float, float, float]) -> SceneObject:
    """A square that faces +z, 2 m in front of a camera at the origin that looks along -z."""
    x, y = centre
    mesh = patch((x - half, y - half, -2), (2 * half, 0, 0), (0, 2 * half, 0))
    return SceneObject(name, mesh, "black", emission=colour)


CAMERA = Camera("c", (0, 0, 0), (0, 0, -1), fov_y_deg=90.0)


def test_right_is_right_and_row_0_is_on_top() -> None:
    objects = (lamp("red", (1.5, 0), 0.2, (1, 0, 0)), lamp("green", (0, 1.5), 0.2, (0, 1, 0)))
    image, _ = render_reference(Scene("s", objects, {"black": BLACK}), CAMERA, 48, 32, 16)
    row, column = np.argwhere(image[..., 0] > 0.5).mean(axis=0) + 0.5
    assert (row, column) == pytest.approx((16, 24 + 1.5 / 2 * 16), abs=0.1)
    row, column = np.argwhere(image[..., 1] > 0.5).mean(axis=0) + 0.5
    assert (row, column) == pytest.approx((16 - 1.5 / 2 * 16, 24), abs=0.1)


def test_field_of_view_is_the_full_vertical_angle() -> None:
    scene = Scene("s", (lamp("white", (0, 0), 1.0, (1, 1, 1)),), {"black": BLACK})
    image, _ = render_reference(scene, CAMERA, 64, 32, 16)
    assert image[:, 32, 0].sum() == pytest.approx(16, abs=0.5), "1 m at 2 m: half of tan 45"
    camera = replace(CAMERA, up=(1.0, 0.0, 0.0), fov_y_deg=60.0)
    image, _ = render_reference(scene, camera, 32, 64, 16)
    assert image[:, 16, 0].sum() == pytest.approx(64 * 0.5 / np.tan(np.pi / 6), abs=0.5)


@pytest.mark.parametrize("albedo", [0.5, 0.9])
def test_furnace_is_one_and_the_variance_tells_the_noise(albedo: float) -> None:
    image, variance = render_reference(furnace(albedo), CAMERA, 32, 24, 256)
    assert abs(image.mean() - 1) < 5 * np.sqrt(variance.mean() / (32 * 24))
    z = (image.mean(axis=-1) - 1) / np.sqrt(variance.mean(axis=-1))
    assert 0.8 < z.std() < 1.2


def test_same_seed_same_picture() -> None:
    a, _ = render_reference(furnace(), CAMERA, 8, 8, 4, seed=3)
    b, _ = render_reference(furnace(), CAMERA, 8, 8, 4, seed=3)
    c, _ = render_reference(furnace(), CAMERA, 8, 8, 4, seed=4)
    assert np.array_equal(a, b) and not np.array_equal(a, c)
