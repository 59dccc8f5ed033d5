"""Faces that no sun reaches are left out of the sun's pass; pictures stay as they are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from lambent.realtime.sun import sun_pass
from lambent.realtime.sun.sunlit_faces import sunlit_faces
from lambent.scenes.geometry import box, placed
from tests.bake.small_scenes import turned_inwards
from tests.realtime.test_realtime_sun import DOWN, floor, plate
from tests.realtime.test_realtime_sunlit import INSIDE, baked

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
