"""Computed environments: images of rooms, with small bright lights, that scenes name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.latlong import lat_long_directions
from lambent.scenes import load_scene
from lambent.scenes.scene import ComputedEnvironment
from lambent.scenes.sky.computed import COMPUTED, HEIGHT, SUN, lat_long_image
from tests.scenes.loaders.test_toml import MATERIALS, written


@pytest.mark.parametrize("name", ("gallery", "nave", "studio"))
def test_interiors_are_lit_by_small_bright_lights(name: str) -> None:
    image = lat_long_image(name)
    assert image.shape == (HEIGHT, 2 * HEIGHT, 3) and image.dtype == np.float32
    assert np.isfinite(image).all() and image.min() > 0
    theta = (np.arange(HEIGHT) + 0.5) / HEIGHT * np.pi
    weight = np.broadcast_to(np.sin(theta)[:, None], image.shape[:2])
    bright = image.mean(axis=-1) > 5
    light = image.mean(axis=-1) * weight
    assert light[bright].sum() > 0.7 * light.sum()
    assert weight[bright].sum() < 0.06 * weight.sum()
    assert image.max() > 1e4 * image.min()


@pytest.mark.parametrize("name", COMPUTED)
def test_the_image_is_the_mean_of_the_interior(name: str) -> None:
    """Texels that no edge crosses are the radiance in their direction: the image is oriented as core.latlong."""
    at_centre = COMPUTED[name](lat_long_directions(HEIGHT, 2 * HEIGHT))
    near = np.isclose(lat_long_image(name), at_centre, rtol=0.05, atol=1e-3).all(axis=-1)
    assert near.mean() > 0.95


def test_a_scene_names_an_interior(tmp_path: Path) -> None:
    said = MATERIALS + '[environment]\nkind = "computed"\nname = "nave"\n'
    assert load_scene(written(tmp_path, said)).environment == ComputedEnvironment("nave")
    with pytest.raises(UserError, match=r"crypt.*gallery, nave, park"):
        load_scene(written(tmp_path, said.replace("nave", "crypt")))


def test_the_path_tracer_sees_the_interior(mi: Any) -> None:
    from lambent.bake.sky.cube import environment_cube
    from lambent.core.geometry.cubemap import face_directions
    from lambent.core.geometry.directions import normalize

    n = 48
    cube = environment_cube(ComputedEnvironment("gallery"), n).astype(float)
    w = normalize(face_directions(n))
    brightest = w.reshape(-1, 3)[np.argmax(cube.sum(axis=-1))]
    assert brightest @ normalize(np.array([0.72, 0.64, -0.28])) > 0.995  # the skylight
    windows = (w[..., 0] < -0.8) & (np.abs(w[..., 1]) < 0.3)
    opposite = (w[..., 0] > 0.8) & (np.abs(w[..., 1]) < 0.3)
    assert cube[windows].mean() > 10 * cube[opposite].mean()


def test_the_park_is_bright_and_dark_in_many_colours() -> None:
    image = lat_long_image("park")
    assert np.isfinite(image).all() and image.min() > 0 and image.max() > 1e5 * image.min()
    w = lat_long_directions(*image.shape[:2])
    at = np.unravel_index(image.sum(axis=-1).argmax(), image.shape[:2])
    assert w[at] @ SUN > np.cos(np.radians(1.5))
    band = image[w[..., 1] > 0].astype(float)
    share = band / band.sum(axis=-1, keepdims=True)
    for channel in range(3):  # red and green leaves, blue sky
        assert (share[:, channel] > 0.45).mean() > 0.02


def test_the_park_has_no_seam() -> None:
    """Neighbours across the first and the last column differ no more than those within."""
    image = np.log(lat_long_image("park").astype(float))
    within = np.abs(np.diff(image, axis=1)).mean()
    assert np.abs(image[:, 0] - image[:, -1]).mean() < 2 * within
