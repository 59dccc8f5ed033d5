"""Where the bake says that no sun gets, none is drawn, and faces there are left out; penumbras stay whole."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.quality import Quality
from lambent.core.pictures.images import write_image
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.baked import BakedScene, read_baked
from lambent.realtime.renderer import Renderer
from lambent.realtime.sun import sun_pass
from lambent.realtime.sun.sunlit_faces import sunlit_faces
from lambent.realtime.sun.turned_sky import under_turned_sky
from lambent.scenes.geometry import box, placed, sphere
from lambent.scenes.scene import ImageEnvironment, Mesh, Scene, SceneObject
from lambent.store.store import Store
from lambent.store.sunlit import GEOMETRY
from tests.baking.sky.test_sun import disc
from tests.baking.small_scenes import TINY, turned_inwards
from tests.realtime.sun.test_realtime_sun import DOWN, TOWARDS, drawn, floor, places, plate, traced

FINE = TINY.changed("fine", geometry={"texels": 320}, light_map={"samples": (4, 4)})


INSIDE = Camera(name="inside", position=(-1.5, 1.2, 1.2), target=(1.0, 1.6, -1.0), fov_y_deg=80.0)


def baked(
    folder: Path, meshes: dict[str, Mesh], radius_deg: float, camera: Camera, quality: Quality = TINY
) -> BakedScene:
    """Under a sun alone, whose light on a surface that faces it is that of `test_realtime_sun`."""
    folder.mkdir(exist_ok=True)
    write_image(folder / "sky.exr", disc(TOWARDS, radius_deg, 1000.0))
    objects = tuple(SceneObject(name, mesh, "grey") for name, mesh in meshes.items())
    environment = ImageEnvironment(folder / "sky.exr", rotation_deg=180.0, layout="lat-long")
    scene = Scene("sunny", objects, {"grey": Material(kd=0.5)}, environment=environment, cameras=(camera,))
    bake(scene, folder / "store", quality=quality, only=("sunlit",))
    found = read_baked(Store.open(folder / "store"))
    assert found.sun is not None and found.irradiance is not None
    assert np.linalg.norm(np.array(found.sun.direction) - TOWARDS) < 2e-3
    back = None if found.irradiance_back is None else 0 * found.irradiance_back
    sun = found.sun.model_copy(update={"irradiance": (3.0, 2.0, 1.0)})
    return replace(found, irradiance=0 * found.irradiance, irradiance_back=back, sun=sun, unit=1.0)


@pytest.mark.long
def test_no_sun_gets_into_a_closed_room_of_sheets(tmp_path: Path, device: Any) -> None:
    """Walls and ceiling without thickness; a plane outside makes the texels of the shadow map 2 cm wide."""
    room = placed(turned_inwards(box((4, 3, 4))), (0, 1.5, 0))
    plane = placed(floor(200.0), (0, -0.01, 0))
    found = baked(tmp_path, {"room": room, "plane": plane}, 4.0, INSIDE)
    assert drawn(device, replace(found, sunlit=None), INSIDE, frames=4).max() > 0, "the shadow map alone leaks"
    assert drawn(device, found, INSIDE, frames=4).max() == 0
    assert drawn(device, found, INSIDE, alone=True).max() == 0


@pytest.mark.long
def test_penumbras_are_not_cut(tmp_path: Path, device: Any) -> None:
    """Texels of the light map are larger than the penumbra of the opening, or smaller."""
    found = baked(tmp_path, {"floor": floor(), "plate": plate()}, 4.0, DOWN)
    assert found.sun is not None
    with_map, without = (drawn(device, one, frames=4) for one in (found, replace(found, sunlit=None)))
    expected = traced(places(DOWN), np.degrees(found.sun.radius_rad))
    assert np.array_equal(with_map[expected > 0], without[expected > 0])


@pytest.mark.long
def test_facets_of_a_ball_are_not_cut(tmp_path: Path, device: Any) -> None:
    """Texels are smaller than facets; some of these turn away from the sun where the ball does not."""
    middle = (0.0, 0.55, 0.0)
    camera = Camera(name="aside", position=(1.2, 1.5, 2.2), target=middle, fov_y_deg=32.0)
    found = baked(tmp_path, {"ball": placed(sphere(0.5, 24, 12), middle)}, 0.5, camera, FINE)
    assert found.sunlit is not None and found.sunlit.mean() < 0.9
    with_map, without = (drawn(device, one, camera, 1) for one in (found, replace(found, sunlit=None)))
    assert np.abs(with_map - without).max() < 0.02, ".09 where rays leave the facets"


@pytest.mark.long
def test_texels_hold_for_their_sun_and_geometry_alone(tmp_path: Path) -> None:
    found = baked(tmp_path, {"floor": floor(), "plate": plate()}, 1.0, DOWN)
    assert found.sunlit is not None and 0 < found.sunlit.mean() < 1
    assert under_turned_sky(replace(found, environment=np.ones((6, 4, 4, 3), np.float32)), 20.0).sunlit is None
    store = Store.open(tmp_path / "store")
    store.put(GEOMETRY, "geometry", store.read(GEOMETRY), key="of another geometry")
    assert read_baked(store).sunlit is None


rng = np.random.default_rng(5)


def test_no_face_with_a_lit_texel_is_left_out() -> None:
    sunlit = (rng.uniform(size=(40, 60)) < 0.02).astype(np.uint8)
    uv2 = (rng.uniform(-0.05, 1.05, (500, 1, 2)) + rng.normal(size=(500, 3, 2)) * 0.03).reshape(-1, 2)
    faces = np.arange(1500, dtype=np.uint32).reshape(-1, 3)
    weights = rng.dirichlet([1, 1, 1], 400)
    at = np.clip((weights @ uv2[faces]) * [60, 40], 0, [59, 39]).astype(int)
    lit = sunlit[at[..., 1], at[..., 0]].any(axis=1)
    found = sunlit_faces(sunlit, uv2, faces)
    assert 0.05 < lit.mean() < 0.9
    assert found[lit].all()
    assert not found.all()


def test_places_that_are_no_numbers_count_as_lit() -> None:
    uv2 = np.array([[0.5, 0.5], [0.6, 0.5], [np.nan, 0.6]])
    assert sunlit_faces(np.zeros((8, 8), np.uint8), uv2, np.array([[0, 1, 2]], np.uint32)).all()


@pytest.mark.long
def test_a_picture_is_the_same_to_the_bit_without_the_faces_that_get_no_sun(
    tmp_path: Path, device: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A plate over a floor, and a closed room below ground; the camera passes over the shadow's edge."""
    room, ground = placed(turned_inwards(box((4, 3, 4))), (0, -8, 0)), placed(floor(200.0), (0, -0.5, 0))
    meshes = {"room": room, "ground": ground, "floor": floor(), "plate": plate()}
    found = baked(tmp_path, meshes, 4.0, DOWN)
    positions = [(x, DOWN.position[1], DOWN.position[2]) for x in (0.0, 0.3, 0.6)]
    cameras = [replace(DOWN, position=at, target=(at[0], *DOWN.target[1:])) for at in positions]
    cameras.append(replace(INSIDE, position=(-1.5, -8.3, 1.2), target=(1.0, -7.9, -1.0)))
    states = [FrameState(camera, 96, 64) for camera in cameras]
    less = Renderer(device, found)
    assert less.resources.sun.reached_faces is not None and 0 < less.resources.sun.reached_faces.mean() < 1
    images = [less.image(state) for state in states]
    calls = less.statistics["draw_calls"]
    assert images[0].max() > 0
    monkeypatch.setattr(sun_pass, "_reached", lambda clusters, sun: True)
    whole = Renderer(device, found)
    assert all(np.array_equal(image, whole.image(state)) for image, state in zip(images, states, strict=True))
    assert calls < whole.statistics["draw_calls"], "the last camera is in the dark room"
