"""Direct sunlight by the shadow map: a plate with an opening over a floor, whose penumbra is known by rays."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lambent.core.camera import Camera, pixel_rays
from lambent.core.directions import basis, normalize
from lambent.core.sequences import hammersley
from lambent.materials.document import Material
from lambent.realtime.baked import BakedScene
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from lambent.realtime.sun import SIDE, block_ranges, squares_of
from lambent.realtime.unbaked import unbaked_scene
from lambent.scenes.geometry import box, merge, patch, placed
from lambent.scenes.scene import Mesh
from lambent.store.contract import SunRecord

Floats = NDArray[np.floating]
TOWARDS = normalize(np.array([0.3, 0.9, 0.2]))
IRRADIANCE = (3.0, 2.0, 1.0)
HEIGHT, HALF = 2.0, 0.5  # of the plate, and half the side of its opening, metres
DOWN = Camera(name="down", position=(-0.7, 1.9, -0.4), target=(-0.7, 0.0, -0.401), fov_y_deg=60.0)
SIZE = 96


def plate() -> Mesh:
    """A plate of 8 m in the plane y = HEIGHT with a square opening about x = z = 0."""
    far = 4.0
    sides = [
        ((-far, far), (HALF, far)), ((-far, far), (-far, -HALF)), ((-far, -HALF), (-HALF, HALF)),
        ((HALF, far), (-HALF, HALF)),
    ]  # fmt: skip
    parts = (patch((x[0], HEIGHT, z[1]), (x[1] - x[0], 0, 0), (0, 0, z[0] - z[1])) for x, z in sides)
    return merge(parts)


def floor(half: float = 4.0) -> Mesh:
    return patch((-half, 0, half), (2 * half, 0, 0), (0, 0, -2 * half))


def scene(meshes: dict[str, Mesh], radius_deg: float, material: Material | None = None, **record: Any) -> BakedScene:
    """Under the sun alone: light maps are black."""
    environment = np.zeros((6, 4, 4, 3), np.float32)
    dark = unbaked_scene(meshes, material or Material(name="grey", kd=0.5), environment)
    sun = SunRecord(direction=tuple(TOWARDS), irradiance=IRRADIANCE, radius_rad=np.radians(radius_deg))
    return replace(dark, sun=sun, record=dark.record.model_copy(update={"cameras": (DOWN,), **record}))


def drawn(device: Any, baked: BakedScene, camera: Camera = DOWN, frames: int = 16, **state: Any) -> Floats:
    """(SIZE, SIZE) irradiance of the first channel, over that of a surface that faces the sun."""
    renderer = Renderer(device, baked)
    how = {"show": "light-map", "antialias": False, **state}
    shown = [renderer.image(FrameState(camera, SIZE, SIZE, accumulate=k, **how)) for k in range(frames)]
    return shown[-1][..., 0] / IRRADIANCE[0]


def places(camera: Camera) -> Floats:
    """(SIZE, SIZE, 3) of the floor that the pixels show."""
    w = pixel_rays(camera, SIZE, SIZE)
    return np.asarray(camera.position - w * (camera.position[1] / w[..., 1:2]))


def traced(points: Floats, radius_deg: float) -> Floats:
    """Share of the sun's disc that points of the floor see through the opening."""
    t, b = basis(TOWARDS)
    u = hammersley(4096)
    disc = np.tan(np.radians(radius_deg)) * np.sqrt(u[:, :1]) * np.column_stack(
        [np.cos(2 * np.pi * u[:, 1]), np.sin(2 * np.pi * u[:, 1])]
    )  # fmt: skip
    w = TOWARDS + disc[:, :1] * t + disc[:, 1:] * b
    step = (w / w[:, 1:2])[:, [0, 2]] * HEIGHT
    at = points.reshape(-1, 1, 3)[..., [0, 2]] + step
    return np.asarray((np.abs(at).max(axis=-1) < HALF).mean(axis=1).reshape(points.shape[:2]))


@pytest.mark.parametrize("radius_deg", [0.27, 3.0])
def test_penumbra_is_that_of_rays_to_the_disc(device: Any, radius_deg: float) -> None:
    found = drawn(device, scene({"floor": floor(), "plate": plate()}, radius_deg)) / TOWARDS[1]
    expected = traced(places(DOWN), radius_deg)
    penumbra = (expected > 0.02) & (expected < 0.98)
    assert penumbra.sum() > 100 and (expected > 0.98).sum() > 100
    assert np.abs(found - expected)[~penumbra].max() < 0.05
    assert np.abs(found - expected)[penumbra].mean() < 0.04
    assert found.mean() == pytest.approx(expected.mean(), rel=0.01), "no light is lost or won"
