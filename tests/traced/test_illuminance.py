"""Illuminance at points in free space: by hand, against whole paths, and its standard error."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.core.light.glare import glare
from lambent.core.light.photometry import LM_PER_W, photometric
from lambent.core.views.panorama import Panorama
from lambent.core.views.projections import Projection, View
from lambent.scenes.geometry import box, patch, placed, sphere
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import ConstantEnvironment, DirectionalLight, Scene, SceneObject
from lambent.store.store import Store
from lambent.traced.picture import TracedPicture
from lambent.traced.room import TracedRoom, room_of_paths, room_of_store
from tests.baking.small_scenes import BLACK, GREY, TINY, furnace, plane
from tests.traced.lit_grids import CANDELA, PLANE, VERTICAL_DEG, lux_from, write_hall
from tests.traced.test_traced_pictures import WIDE, lit_room

pytestmark = [pytest.mark.usefixtures("mi"), pytest.mark.slow]
UP = np.array([0.0, 1.0, 0.0])
PLACES = np.array([(x, y, z) for x in (-0.8, -0.3, 0.7) for z in (-0.8, 0.1, 0.6) for y in (0.002, 0.75, 1.4)])


def baked(scene: Scene, folder: Path, **options: Any) -> Store:
    return bake(scene, folder / "s", quality=TINY, only=("light_map", "lamps"), **options)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory, mi: Any) -> Store:
    return baked(lit_room(), tmp_path_factory.mktemp("lit"), light_groups="scene")


@pytest.fixture(scope="module")
def room(store: Store) -> TracedRoom:
    return room_of_store(store, lit_room())


def by_paths(
    scene: Scene, points: np.ndarray, normal: np.ndarray, samples: int = 1 << 12, parts: int = 12
) -> tuple[np.ndarray, np.ndarray]:
    """Lx (n,) and their standard errors by whole paths alone, without a light map."""
    import mitsuba as mi

    from lambent.baking.tracing.path_tracer import Points, irradiance
    from lambent.baking.tracing.rays import block_sums, independent, vectors

    traced = room_of_paths(scene)._traced
    places = vectors(mi.Point3f, points.repeat(samples, axis=0))
    facing = vectors(mi.Vector3f, np.broadcast_to(normal, (len(points) * samples, 3)))
    found = []
    for seed in range(parts):
        sampler = independent(seed, len(points) * samples)
        u, v = sampler.next_2d(), sampler.next_2d()
        light = irradiance(traced.whole(diffuse=True), sampler, Points(places, facing, facing), u, v, 32)
        found.append(photometric(block_sums(light, samples) / samples))
    return np.mean(found, axis=0), np.std(found, axis=0, ddof=1) / np.sqrt(parts)


def test_a_furnace_has_irradiance_pi(tmp_path: Path) -> None:
    points = np.array([[0, 0, 0], [0.5, -0.9, 0.3], [0.9, 0.9, -0.9], [-0.99, -0.99, 0.99]])
    room = room_of_store(baked(furnace(), tmp_path), furnace())
    for normal in np.array([UP, -UP, (0.6, 0, 0.8)]):
        lx, error_lx = room.illuminance(points, normal, 0.002)
        np.testing.assert_allclose(lx / LM_PER_W, np.pi, rtol=0.006)
        assert (error_lx <= 0.002 * lx).all()


LAMPS = {
    "point": ('kind = "point"\ncandela = 500', lambda deg: np.full_like(deg, 500.0)),
    "spot": ('kind = "spot"\ncandela = 800\ndirection = [0, -1, 0]\ninner_deg = 20\nouter_deg = 60',
             lambda deg: 800 * np.clip((60 - deg) / 40, 0, 1)),
    "ies": ('kind = "ies"\nfile = "lamp.ies"', lambda deg: np.interp(deg, VERTICAL_DEG, CANDELA)),
}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("kind", LAMPS)
def test_a_lamp_in_a_black_room_obeys_inverse_square_and_cosine(tmp_path: Path, kind: str) -> None:
    text, candela = LAMPS[kind]
    scene = load_scene(str(write_hall(tmp_path, f"[[lights]]\n{text}\nposition = [0.4, 2.6, -0.3]\n{PLANE}")))
    (grid,) = scene.grids
    room = room_of_store(baked(scene, tmp_path), scene)
    for normal in (grid.normal, np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, 1.0])):
        expected = lux_from((0.4, 2.6, -0.3), grid.points, normal, candela)
        lx, _ = room.illuminance(grid.points, normal, 0.01)
        np.testing.assert_allclose(lx, expected, rtol=2e-3, atol=1e-3 * expected.max())
    assert lux_from((0.4, 2.6, -0.3), grid.points, grid.normal, candela).max() > 100


@pytest.mark.long
def test_a_sky_and_a_sun_of_known_illuminance(tmp_path: Path) -> None:
    """Above an open black plane: pi L upright, half of that on a wall, and the sun by its cosine."""
    points = np.array([[0.0, 0.0, 0.0], [0.3, 1.5, -0.4]])
    sun = DirectionalLight((0.6, -0.8, 0.0), (2.0, 2.0, 2.0))
    scene = replace(plane(), environment=ConstantEnvironment((1.0, 1.0, 1.0)), lights=(sun,))
    room = room_of_store(baked(scene, tmp_path), scene)
    assert room.illuminance(points, UP, 0.002)[0] / LM_PER_W == pytest.approx(np.pi + 2 * 0.8, rel=0.005)
    upright = room.illuminance(np.array([[0.0, 1e-3, 0.0]]), np.array([-1.0, 0.0, 0.0]), 0.002)[0]
    assert upright / LM_PER_W == pytest.approx(np.pi / 2 + 2 * 0.6, rel=0.01), "the ground fills the lower half"


@pytest.mark.long
def test_points_on_surfaces_and_in_the_air_have_the_light_of_whole_paths(room: TracedRoom) -> None:
    """With a lamp of some size, a point light, mirrored light and shadows; the map is that of a preview."""
    for normal in (UP, np.array([0.0, 0.0, 1.0])):
        lx, error_lx = room.illuminance(PLACES, normal, 0.004)
        true, noise = by_paths(lit_room(), PLACES, normal)
        assert (error_lx <= 0.004 * lx).all() and (noise < 0.015 * true).all()
        assert (np.abs(lx - true) < 0.02 * true + 2.5 * noise).all()
        assert lx.mean() == pytest.approx(true.mean(), rel=0.01) and lx.max() > 3 * lx.min()


@pytest.mark.long
def test_an_eye_in_a_fisheye_has_the_illuminance_of_a_point_that_faces_its_view(tmp_path: Path) -> None:
    """Of lamps with a surface: what `lambent glare` calls illuminance at the eye, from a picture."""
    scene = replace(lit_room(), lights=())
    room, eye = room_of_store(baked(scene, tmp_path), scene), np.array(WIDE.position)
    view = View.of(WIDE, Projection.fisheye, 128, 128)
    around = Panorama(view, 128, 128)
    for face, camera in enumerate(around.cameras):
        picture = TracedPicture(room.tracer, camera, (around.side_px, around.side_px))
        while picture.samples < 64:
            picture.sample()
        around.fill(face, picture.mean())
    ahead = np.array(WIDE.target) - eye
    lx, _ = room.illuminance(eye[None], ahead / np.linalg.norm(ahead), 0.002)
    assert glare(around.image(), view).illuminance_lx == pytest.approx(float(lx[0]), rel=0.015)


@pytest.mark.long
def test_a_mix_of_lamps_is_the_sum_of_their_light(room: TracedRoom) -> None:
    off, found = (0.0, 0.0, 0.0), {}
    for name, factors in (("all", {}), ("bulb", {"lamp": off}), ("lamp", {"bulb": (0.5, 0.5, 0.5)}), ("dark", None)):
        room.mix({"lamp": off, "bulb": off} if factors is None else factors)
        found[name] = room.illuminance(PLACES, UP, 0.003)[0]
    room.mix({})
    assert not found["dark"].any()
    np.testing.assert_allclose(found["lamp"] + found["bulb"] / 2, found["all"], rtol=0.015)


@pytest.mark.long
def test_the_stated_error_is_that_of_the_result(room: TracedRoom) -> None:
    true, _ = room.illuminance(PLACES, UP, 0.001)
    lx, error_lx = room.illuminance(PLACES, UP, 0.03)
    off = (lx - true) / error_lx
    assert 0.6 < np.sqrt((off**2).mean()) < 1.6 and np.abs(off).max() < 5
    assert (error_lx <= 0.03 * lx).all() and np.abs(off).min() > 0


@pytest.mark.long
def test_points_within_furniture_are_none(tmp_path: Path) -> None:
    """Of a floor with a chest and a ball; an open sheet is no solid, and a point on the chest is not in it."""
    objects = (
        SceneObject("floor", patch((-1, 0, 1), (2, 0, 0), (0, 0, -2)), "black"),
        SceneObject("chest", placed(box((0.6, 0.5, 0.6)), (-0.5, 0.25, 0)), "grey"),
        SceneObject("ball", placed(sphere(0.3, 32, 16), (0.5, 0.3, 0)), "grey"),
        SceneObject("sheet", patch((-0.2, 0.6, 0.9), (0.4, 0, 0), (0, 0, -0.3)), "grey"),
    )
    scene = Scene("f", objects, {"grey": GREY, "black": BLACK}, environment=ConstantEnvironment((1.0, 1.0, 1.0)))
    room = room_of_store(baked(scene, tmp_path), scene)
    points = np.array([[-0.5, 0.3, 0], [0.5, 0.3, 0], [0, 0.3, 0], [0, 0.55, 0.75], [-0.5, 0.5, 0.0]])
    lx, error_lx = room.illuminance(points, UP, 0.01)
    assert np.isnan(lx).tolist() == np.isnan(error_lx).tolist() == [True, True, False, False, False]
    assert lx[3] < 0.5 * lx[4] and lx[4] == pytest.approx(np.pi * LM_PER_W, rel=0.02)
