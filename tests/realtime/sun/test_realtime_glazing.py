"""Clear glass in frames: what is behind it is seen straight through, as much of it as the material lets pass."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.core.arrays import Floats
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.baked import BakedScene
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import box, patch, placed
from lambent.scenes.scene import MaterialTextures, Mesh
from lambent.store.contract import ReflectorPart, ReflectorRecord
from tests.realtime.sun.test_realtime_panes import CLEAR, RED, glazed, passed
from tests.realtime.sun.test_realtime_panes import pane as pane_at
from tests.realtime.sun.test_realtime_sun import DOWN, SIZE

SLANTED = replace(DOWN, position=(0.0, 4.0, 4.0), target=(0.0, 0.0, 0.0))


def glowing(parts: dict[str, tuple[Mesh, str]], textures: dict[str, MaterialTextures] | None = None) -> BakedScene:
    """The floor and what is grey emit light of their own; there is no other, and so nothing to be mirrored."""
    baked = replace(glazed(parts, textures), sun=None)
    emission = {"floor": (1.0, 0.8, 0.6), "stone": (0.2, 0.9, 0.3)}
    objects = [o.model_copy(update={"emission": emission.get(o.name, (0.0, 0.0, 0.0))}) for o in baked.record.objects]
    return replace(baked, record=baked.record.model_copy(update={"objects": tuple(objects)}))


def shown(device: Any, baked: BakedScene, camera: Camera = DOWN, **how: Any) -> Floats:
    """(SIZE, SIZE, 3) radiance."""
    return Renderer(device, baked).image(FrameState(camera, SIZE, SIZE, antialias=False, **how))


def middle(image: Floats) -> Floats:
    return np.asarray(image[SIZE // 2 - 2 : SIZE // 2 + 2, SIZE // 2 - 2 : SIZE // 2 + 2].mean(axis=(0, 1)))


@pytest.mark.parametrize(("camera", "integrator"), [(DOWN, "qmc"), (SLANTED, "lamps")])
def test_glass_lets_its_share_pass(device: Any, camera: Camera, integrator: str) -> None:
    bare = shown(device, glowing({}), camera, integrator=integrator)
    ray = np.subtract(camera.target, camera.position)
    cosine = abs(ray[1]) / np.linalg.norm(ray)
    for material in (CLEAR, RED):
        seen = shown(device, glowing({"pane": (pane_at(1.0), material.name)}), camera, integrator=integrator)
        np.testing.assert_allclose(middle(seen), middle(bare) * passed(material, cosine), rtol=0.01, atol=1e-4)


def test_a_solid_has_two_faces(device: Any) -> None:
    solid = placed(box((2.0, 0.1, 2.0)), (0.0, 1.0, 0.0))
    seen = middle(shown(device, glowing({"solid": (solid, "clear")})))
    np.testing.assert_allclose(seen, middle(shown(device, glowing({}))) * passed(CLEAR, 1.0) ** 2, rtol=0.01)


def test_glass_hides_nothing_and_what_stands_before_it_hides_it(device: Any) -> None:
    stone = placed(box((0.4, 0.1, 0.4)), (DOWN.position[0], 1.4, DOWN.position[2])), "grey"
    alone = shown(device, glowing({"stone": stone}))
    below = shown(device, glowing({"stone": stone, "pane": (pane_at(1.0), "red")}))
    np.testing.assert_allclose(middle(below), middle(alone), rtol=1e-3)  # the picture is in half floats
    behind = shown(device, glowing({"stone": stone, "pane": (pane_at(1.6), "red")}))
    np.testing.assert_allclose(middle(behind), middle(alone) * passed(RED, 1.0), rtol=0.01, atol=1e-4)


@pytest.mark.long
def test_a_mirror_shows_what_is_behind_glass(device: Any) -> None:
    """A mirror on the floor, looked at from the side, a glowing wall behind it, and glass between both."""
    wall = patch((-3, 0, -2), (6, 0, 0), (0, 4, 0))
    sheet = patch((-3, 0.01, -1), (6, 0, 0), (0, 4, 0))
    camera = Camera("over the mirror", (0.0, 1.0, 2.0), (0.0, 0.0, 0.5), fov_y_deg=30.0)
    mirror = Material(name="grey", lobes=(Lobe(mx=0.003, my=0.003, r0=(0.9, 0.9, 0.9)),))

    def mirrored(parts: dict[str, tuple[Mesh, str]], planar: str) -> Floats:
        baked = glowing({"stone": (wall, "grey"), **parts})
        outline = tuple((x, 0.0, z) for x, z in ((-2, -0.9), (2, -0.9), (2, 2), (-2, 2)))
        part = ReflectorPart(object="floor", faces=(0, 1), area_m2=11.6)
        reflector = ReflectorRecord(plane=(0.0, 1.0, 0.0, 0.0), outline=outline, parts=(part,))
        baked = replace(baked, record=baked.record.model_copy(update={"reflectors": (reflector,)}))
        return shown(device, baked, camera, materials={"grey": mirror}, show="specular", planar=planar)

    bare = middle(mirrored({}, "auto"))
    assert bare.min() > 0.05, "the wall is mirrored"
    seen = middle(mirrored({"pane": (sheet, "red")}, "auto"))
    np.testing.assert_allclose(seen[:2] / bare[:2], passed(RED, 1.5 / np.hypot(1.0, 1.5))[:2], rtol=0.02)
