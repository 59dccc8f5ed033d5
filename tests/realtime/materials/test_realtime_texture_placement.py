"""Where the texels of a texture lie, for every kind of texture, as drawn."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.objects.unbaked import unbaked_scene
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import patch
from lambent.scenes.scene import IDENTITY, MaterialTextures, Texture
from tests.realtime.lit_wall import cube_of, smooth_light
from tests.tools.texture_tiles import REPEATED, tiles

FRONT = Camera("c", (0.3, -0.4, 2.0), (0.0, 0.0, 0.0), fov_y_deg=28.0)
MATERIAL = Material(name="m", kd=0.4, lobes=(Lobe(mx=0.3, my=0.12, k=0.5, r0=0.6),))
STATE = FrameState(FRONT, 48, 48, integrator="qmc", n=64, accumulate=0, antialias=False)


@pytest.mark.parametrize("part", REPEATED)
def test_a_uv_transform_is_a_picture_of_many(device: Any, part: str) -> None:
    def seen(texture: Texture) -> np.ndarray:
        mesh = patch((-0.5, -0.5, 0), (1, 0, 0), (0, 1, 0))
        scene = unbaked_scene({"o": mesh}, MATERIAL, cube_of(smooth_light), irradiance=(1.0, 1.0, 1.0))
        return Renderer(device, replace(scene, textures={"m": MaterialTextures(**{part: texture})})).image(STATE)

    moved, repeated = tiles(part)
    one, other, unmoved = (seen(texture) for texture in (moved, repeated, replace(moved, uv_transform=IDENTITY)))
    assert np.abs(one - other).mean() < 0.05 * np.abs(one - unmoved).mean()
    np.testing.assert_allclose(one, other, rtol=2e-2, atol=4e-3)
