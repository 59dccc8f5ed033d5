"""The environment's cube map against the path tracer's environment, and by orientation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.sky.cube import environment_cube
from lambent.core.geometry.cubemap import face_directions, sample, texel_solid_angles
from lambent.core.geometry.directions import normalize
from lambent.core.pictures.images import write_image
from lambent.core.surroundings import Axis, Layout
from lambent.scenes.scene import ImageEnvironment, SunSky
from lambent.scenes.sky.environment_images import orientation
from lambent.store.contract import sun_left_out
from tests.baking.small_scenes import TINY, plane

SUN = normalize(np.array([0.5, 0.6, 0.3]))


def irradiance(cube: np.ndarray, normal: np.ndarray) -> np.ndarray:
    n = cube.shape[1]
    cosine = np.maximum(normalize(face_directions(n)) @ normal, 0)
    return (cube.astype(float) * (cosine * texel_solid_angles(n))[..., None]).sum(axis=(0, 1, 2))


@pytest.mark.long
@pytest.mark.parametrize("radius_deg", [0.2679, 4.0])
def test_sky_and_sun_carry_the_path_tracers_energy(tmp_path: Path, radius_deg: float) -> None:
    sky = SunSky(tuple(SUN), sun_radius_deg=radius_deg)
    store = bake(
        replace(plane(), environment=sky), tmp_path / "s", quality=TINY.changed(light_map={"samples": (128, 128)})
    )
    raw = store.read("light_map/traced")
    sun = sun_left_out(store)
    assert sun is not None
    direct = np.multiply(sun.irradiance, sun.direction[1])  # which the light map leaves out
    traced = raw[..., :3].sum(axis=(0, 1, 2)) / raw[..., 3].sum() + direct
    assert irradiance(environment_cube(sky, 128), np.array([0, 1.0, 0])) == pytest.approx(traced, rel=0.02)


def test_the_sun_stands_where_it_is_said_to() -> None:
    cube = environment_cube(SunSky(tuple(SUN)), 64)
    brightest = np.unravel_index(cube[..., 1].argmax(), cube.shape[:3])
    assert normalize(face_directions(64))[brightest] @ SUN > np.cos(np.radians(2))
    assert np.isfinite(cube).all()


def test_below_the_horizon_lies_a_diffuse_ground_lit_by_the_sky() -> None:
    cube = environment_cube(SunSky(tuple(SUN), albedo=0.4), 64)
    from_above, from_below = (irradiance(cube, np.array([0, y, 0])) for y in (1.0, -1.0))
    assert from_below == pytest.approx(0.4 * from_above, rel=0.02)


@pytest.mark.parametrize("rotation_deg", [0.0, 90.0, -30.0])
def test_picture_looks_along_minus_z_in_its_middle_with_plus_x_to_the_right(
    tmp_path: Path, rotation_deg: float
) -> None:
    picture = np.zeros((64, 128, 3), np.float32)
    picture[:8, :, 2] = 1  # top
    picture[28:36, 60:68, 0] = 1  # middle
    picture[28:36, 92:100, 1] = 1  # a quarter to the right
    write_image(tmp_path / "p.exr", picture)
    cube = environment_cube(ImageEnvironment(tmp_path / "p.exr", 2.0, rotation_deg), 32).astype(float)
    angle = np.radians(rotation_deg)
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    for direction, colour in (((0, 0, -1), (2, 0, 0)), ((1, 0, 0), (0, 2, 0)), ((0, 1, 0), (0, 0, 2))):
        assert sample(cube, turn @ np.array(direction, float)) == pytest.approx(colour, abs=0.05)


@pytest.mark.parametrize("layout", [None, "cross"])
@pytest.mark.parametrize(
    ("up", "front", "right"),
    [
        ("+y", (0, 0, -1), (1, 0, 0)),
        ("-y", (0, 0, -1), (-1, 0, 0)),
        ("+z", (0, 1, 0), (1, 0, 0)),
        ("-z", (0, -1, 0), (1, 0, 0)),
        ("+x", (0, 0, -1), (0, -1, 0)),
        ("-x", (0, 0, -1), (0, 1, 0)),
    ],
)
def test_a_cross_lies_as_its_up_axis_says(
    tmp_path: Path, up: Axis, front: tuple[int, ...], right: tuple[int, ...], layout: Layout | None
) -> None:
    """Top blue, front red, right green; turned by 90 degrees about its own up, its front is where its left was."""
    n = 16
    picture = np.zeros((3 * n, 4 * n, 3), np.float32)
    picture[:n, n : 2 * n, 2] = 1
    picture[n : 2 * n, n : 2 * n, 0] = 1
    picture[n : 2 * n, 2 * n : 3 * n, 1] = 1
    write_image(tmp_path / "p.exr", picture)
    axis = np.array([(up[1] == a) * (1.0 if up[0] == "+" else -1.0) for a in "xyz"])
    for turned, at in ((0.0, (front, right)), (90.0, (tuple(-np.array(right)), front))):
        environment = ImageEnvironment(tmp_path / "p.exr", 1.0, turned, layout, up)
        cube = environment_cube(environment, 32).astype(float)
        for direction, colour in ((at[0], (1, 0, 0)), (at[1], (0, 1, 0)), (axis, (0, 0, 1))):
            assert sample(cube, np.array(direction, float)) == pytest.approx(colour, abs=0.05)
            of_picture = np.array(direction, float) @ orientation(environment)
            assert of_picture[np.argmax([colour[1], colour[2], colour[0]])] * (-1 if colour[0] else 1) > 0.99


def test_no_environment_is_black() -> None:
    assert not environment_cube(None, 8).any()
