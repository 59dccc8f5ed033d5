"""Environments: which way round a picture lies, computed surroundings, and light cut into triangles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.core.ceilings import Ceiling
from lambent.core.errors import UserError
from lambent.core.geometry.cubemap import face_directions, texel_solid_angles
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.latlong import lat_long_directions
from lambent.core.geometry.triangles import triangle_areas, triangle_normals
from lambent.core.pictures.images import write_image
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import ComputedEnvironment
from lambent.scenes.sky import environment_images
from lambent.scenes.sky.computed import COMPUTED, HEIGHT, SUN, lat_long_image
from lambent.scenes.sky.environment_images import read_lat_long
from lambent.scenes.sky.environments import daylight, from_lat_long
from lambent.scenes.sky.triangle_lights import (
    TriangleLights,
    environment_triangles,
    icosahedron,
    solid_angles,
    surface_triangles,
)
from tests.scenes.loaders.test_toml import MATERIALS, written

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


@pytest.mark.long
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
    from lambent.baking.sky.cube import environment_cube
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


@pytest.mark.long
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


ROWS = 256
W = lat_long_directions(ROWS, 2 * ROWS).reshape(-1, 3)
WEIGHT_SR = np.repeat(-np.diff(np.cos(np.linspace(0, np.pi, ROWS + 1))), 2 * ROWS) * np.pi / ROWS
SUN_AT = normalize(np.array([0.4, 0.6, -0.7]))


def sunny() -> np.ndarray:
    sky = np.clip(W[:, 1:2], 0, 1) * np.array([0.3, 0.5, 1.0]) + 0.1
    return np.where((np.cos(0.03) < W @ SUN_AT)[:, None], 5000.0, sky)


def lights(count: int, radiance: np.ndarray | None = None) -> TriangleLights:
    return environment_triangles(W, WEIGHT_SR, sunny() if radiance is None else radiance, count)


def test_icosahedron_covers_the_sphere() -> None:
    faces = icosahedron()
    assert faces.shape == (20, 3, 3)
    assert np.allclose(solid_angles(faces), np.pi / 5)
    assert (np.einsum("fx,fx->f", np.cross(faces[:, 0], faces[:, 1]), faces[:, 2]) > 0).all()


@pytest.mark.parametrize("count", [20, 50, 400, 4000])
def test_no_light_is_lost(count: int) -> None:
    found = lights(count)
    assert count - 3 < len(found) <= count
    assert np.allclose(found.light.sum(axis=0), (sunny() * WEIGHT_SR[:, None]).sum(axis=0))
    assert solid_angles(found.corners).sum() == pytest.approx(4 * np.pi)
    assert not found.near.any()


def test_the_sun_is_cut_out() -> None:
    """Its light lies in small triangles at its place, and their centres are where it is."""
    found = lights(400)
    bright = found.light.sum(axis=1) > 1e-3 * found.light.sum()
    close = found.centres @ SUN_AT > np.cos(0.04)
    share = found.light[close].sum() / found.light.sum()
    sun_share = (sunny() * WEIGHT_SR[:, None])[np.cos(0.03) < W @ SUN_AT].sum() / found.light.sum() * 1.0
    assert share == pytest.approx(sun_share, abs=0.01)
    assert solid_angles(found.corners)[bright & close].max() < 0.003
    mean = normalize((found.light.sum(axis=1)[:, None] * found.centres)[close].sum(axis=0))
    assert mean @ SUN_AT > np.cos(0.003)


def test_irradiance_of_the_triangles_is_the_environments() -> None:
    found, n = lights(2000), normalize(np.array([0.2, 0.9, 0.3]))
    exact = (sunny() * (WEIGHT_SR * np.maximum(W @ n, 0))[:, None]).sum(axis=0)
    assert np.allclose((found.light * np.maximum(found.centres @ n, 0)[:, None]).sum(axis=0), exact, rtol=2e-3)


def test_lamps_are_cut_into_equal_parts() -> None:
    corners = np.array([[[0, 2, 0], [0, 2, 1], [0.5, 2, 0]], [[0, 0, 0], [1, 0, 0], [0, 1, 0]]], float)
    found = surface_triangles(corners, np.array([[5.0, 4, 3], [1, 2, 3]]), largest_m=0.3)
    areas = triangle_areas(found.corners)
    assert areas.sum() == pytest.approx(triangle_areas(corners).sum())
    edges = np.linalg.norm(found.corners - np.roll(found.corners, 1, axis=1), axis=-1)
    assert edges.max() <= 0.3 + 1e-12
    assert found.near.all()
    first = found.light[:, 0] == 5
    assert np.allclose(triangle_normals(found.corners)[first], triangle_normals(corners)[0])
    assert np.ptp(areas[first]) < 1e-12
