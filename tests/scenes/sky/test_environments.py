"""Environments as cube maps: which way round a picture lies, and the ground under daylight."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.ceilings import Ceiling
from lambent.core.errors import UserError
from lambent.core.geometry.cubemap import face_directions, texel_solid_angles
from lambent.core.geometry.directions import normalize
from lambent.core.pictures.images import write_image
from lambent.scenes.sky import environment_images
from lambent.scenes.sky.environment_images import read_lat_long
from lambent.scenes.sky.environments import daylight, from_lat_long

N = 16


def test_a_picture_lies_upright_and_unmirrored() -> None:
    """Top row +y, middle column -z, to the right +x: one bright place in each of six pictures."""
    places = {(1.0, 0.5): 4, (0.5, 0.5): 5, (0.75, 0.5): 0, (0.25, 0.5): 1, (0.5, 0.0): 2, (0.5, 1.0): 3}
    for (column, row), face in places.items():
        x, y = np.meshgrid((np.arange(64) + 0.5) / 64, (np.arange(32) + 0.5) / 32)
        turned = np.abs((x - column + 0.5) % 1 - 0.5) * np.sin(np.pi * y) * 2
        picture = np.repeat(np.exp(-80 * (turned**2 + (y - row) ** 2))[..., None], 3, axis=2)
        cube = from_lat_long(picture, N)
        light = cube[..., 0].sum(axis=(1, 2))
        assert np.argmax(light) == face and light[face] > 0.9 * light.sum(), (column, row)
        middle = cube[face, N // 2 - 1 : N // 2 + 1, N // 2 - 1 : N // 2 + 1, 0]
        assert middle.min() > 0.5 * cube.max(), "in the middle of its face"


def test_the_ground_returns_three_tenths_of_the_daylight() -> None:
    """Radiance .3/pi E of the sky and the sun above it, the same everywhere below the horizon."""
    sky = daylight(64, (0.3, 0.7, -0.2)).astype(float)
    w = normalize(face_directions(64))
    omega = np.broadcast_to(texel_solid_angles(64), w.shape[:3])
    above = w[..., 1] > 0
    e = (sky * (omega * np.where(above, w[..., 1], 0))[..., None]).sum(axis=(0, 1, 2))
    ground = sky[~above]
    assert np.ptp(ground, axis=0) == pytest.approx(0, abs=1e-6)
    np.testing.assert_allclose(ground[0], 0.3 / np.pi * e, rtol=1e-3)
    brightest = w.reshape(-1, 3)[np.argmax(sky[..., 1])]
    assert brightest @ normalize(np.array([0.3, 0.7, -0.2])) > np.cos(np.radians(2))


def test_values_below_zero_are_black(tmp_path: Path) -> None:
    """Sharpening filters leave them beside lamps; the path tracer and edited pictures took them for different light."""
    picture = np.random.default_rng(0).normal(0.2, 1, (8, 16, 3)).astype(np.float32)
    write_image(tmp_path / "sharpened.exr", picture)
    np.testing.assert_array_equal(read_lat_long(tmp_path / "sharpened.exr"), np.maximum(picture, 0))


def test_a_picture_with_too_many_pixels_is_averaged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Means of 2x2 pixels keep the light of a lamp of one pixel; beyond its own ceiling a picture is refused."""
    picture = np.random.default_rng(2).random((8, 16, 3)).astype(np.float32)
    picture[3, 5] = 1e5
    write_image(tmp_path / "sky.exr", picture)
    monkeypatch.setattr(environment_images, "PIXELS", Ceiling("picture is too large", 8 * 16 - 1, "pixels"))
    read = environment_images.read_lat_long(tmp_path / "sky.exr")
    np.testing.assert_allclose(read, picture.reshape(4, 2, 8, 2, 3).mean(axis=(1, 3)), rtol=1e-6)
    monkeypatch.setattr(environment_images, "SURROUNDINGS_PIXELS", Ceiling("picture is too large", 100, "pixels"))
    with pytest.raises(UserError, match="found 16 x 8, 3 channels; expected at most 100 pixels"):
        environment_images.read_lat_long(tmp_path / "sky.exr")
