"""A light field in another mix of light groups is that which a bake in this mix takes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.core.light.light_mix import Factors
from lambent.core.views.camera import Camera
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import open_device
from lambent.realtime.light.baked import read_baked
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import patch, placed, sphere
from lambent.scenes.scene import LightFieldWish, Scene, SceneObject
from tests.baking.small_scenes import TINY, room_with_step

FINER = TINY.changed("finer", geometry={"texels": 96}, probe={"texels": 64, "samples": 64})
LIT = ("light_map", "probe", "light_field")
BALL = replace(room_with_step().object("ball"), mesh=placed(sphere(0.3, 64, 32), (-0.8, 0.5, 0)))
VIEW = FrameState(Camera("ball", (0.2, 0.9, -0.4), (-0.8, 0.5, 0.0), fov_y_deg=35), 64, 64, n=1, show="specular")
MIX: Factors = {"lamp": (0.0, 0.0, 0.0), "wall lamp": (2.0, 2.0, 2.0)}


def room(lamp: float, wall_lamp: float) -> Scene:
    """A room with a mirror ball that has a light field, lit from above and from low on a wall."""
    step = room_with_step()
    others = [o for o in step.objects if o.name not in ("ball", "lamp")]
    above = replace(step.object("lamp"), emission=(5 * lamp, 5 * lamp, 5 * lamp))
    low = patch((-1.99, 0.2, 1.0), (0, 0.6, 0), (0, 0, 0.8))
    beside = SceneObject("wall lamp", low, "black", emission=(wall_lamp, 3 * wall_lamp, 4 * wall_lamp))
    wish = LightFieldWish(points=48, texels=46)
    return replace(step, objects=(*others, above, beside, BALL), light_fields={"ball": wish})


@pytest.mark.long
def test_it_is_that_of_a_bake_in_this_mix(tmp_path: Path) -> None:
    """Not what was baked; what is left is beside the lamp that is off, whose light texels have spread."""
    device = open_device()
    both = bake(room(1, 1), tmp_path / "both", quality=FINER, only=LIT, light_groups="scene")
    mixed = Renderer(device, read_baked(both))
    again = Renderer(device, read_baked(bake(room(1e-6, 2), tmp_path / "again", quality=FINER, only=LIT)))
    as_baked, truth = mixed.image(VIEW), again.image(VIEW)
    ones = mixed.image(replace(VIEW, light=dict.fromkeys(MIX, (1.0, 1.0, 1.0))))
    np.testing.assert_array_equal(ones, as_baked)
    shown = mixed.image(replace(VIEW, light=MIX))
    np.testing.assert_array_equal(mixed.image(VIEW), as_baked)
    ball = truth.sum(axis=-1) > 0
    off = [float(np.abs(np.log((one[ball] + 0.01) / (truth[ball] + 0.01))).mean()) for one in (shown, as_baked)]
    assert off[0] < 0.07 * off[1], off
    assert shown[ball].mean() == pytest.approx(truth[ball].mean(), rel=0.12)
