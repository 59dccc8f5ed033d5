"""Where the bake says that no sun gets, none is drawn; penumbras stay whole."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.bake.bake import bake
from lambent.bake.quality import Quality
from lambent.core.pictures.images import write_image
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.realtime.light.baked import BakedScene, read_baked
from lambent.realtime.sun.turned_sky import under_turned_sky
from lambent.scenes.geometry import box, placed, sphere
from lambent.scenes.scene import ImageEnvironment, Mesh, Scene, SceneObject
from lambent.store.store import Store
from lambent.store.sunlit import GEOMETRY
from tests.bake.sky.test_sun import disc
from tests.bake.small_scenes import TINY, turned_inwards
from tests.realtime.test_realtime_sun import DOWN, TOWARDS, drawn, floor, places, plate, traced

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


def test_no_sun_gets_into_a_closed_room_of_sheets(tmp_path: Path, device: Any) -> None:
    """Walls and ceiling without thickness; a plane outside makes the texels of the shadow map 2 cm wide."""
    room = placed(turned_inwards(box((4, 3, 4))), (0, 1.5, 0))
    plane = placed(floor(200.0), (0, -0.01, 0))
    found = baked(tmp_path, {"room": room, "plane": plane}, 4.0, INSIDE)
    assert drawn(device, replace(found, sunlit=None), INSIDE, frames=4).max() > 0, "the shadow map alone leaks"
    assert drawn(device, found, INSIDE, frames=4).max() == 0
    assert drawn(device, found, INSIDE, alone=True).max() == 0


@pytest.mark.parametrize("radius_deg", [0.5, 4.0])
def test_penumbras_are_not_cut(tmp_path: Path, device: Any, radius_deg: float) -> None:
    """Texels of the light map are larger than the penumbra of the opening, or smaller."""
    found = baked(tmp_path, {"floor": floor(), "plate": plate()}, radius_deg, DOWN)
    assert found.sun is not None
    with_map, without = (drawn(device, one, frames=4) for one in (found, replace(found, sunlit=None)))
    expected = traced(places(DOWN), np.degrees(found.sun.radius_rad))
    assert np.array_equal(with_map[expected > 0], without[expected > 0])


def test_facets_of_a_ball_are_not_cut(tmp_path: Path, device: Any) -> None:
    """Texels are smaller than facets; some of these turn away from the sun where the ball does not."""
    middle = (0.0, 0.55, 0.0)
    camera = Camera(name="aside", position=(1.2, 1.5, 2.2), target=middle, fov_y_deg=32.0)
    found = baked(tmp_path, {"ball": placed(sphere(0.5, 24, 12), middle)}, 0.5, camera, FINE)
    assert found.sunlit is not None and found.sunlit.mean() < 0.9
    with_map, without = (drawn(device, one, camera, 1) for one in (found, replace(found, sunlit=None)))
    assert np.abs(with_map - without).max() < 0.02, ".09 where rays leave the facets"


def test_texels_hold_for_their_sun_and_geometry_alone(tmp_path: Path) -> None:
    found = baked(tmp_path, {"floor": floor(), "plate": plate()}, 1.0, DOWN)
    assert found.sunlit is not None and 0 < found.sunlit.mean() < 1
    assert under_turned_sky(replace(found, environment=np.ones((6, 4, 4, 3), np.float32)), 20.0).sunlit is None
    store = Store.open(tmp_path / "store")
    store.put(GEOMETRY, "geometry", store.read(GEOMETRY), key="of another geometry")
    assert read_baked(store).sunlit is None
