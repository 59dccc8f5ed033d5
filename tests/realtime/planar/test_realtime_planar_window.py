"""Windows of planar reflection buffers: they hold what lobes of a reflector see, and little more."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

import lambent.realtime.planar.planar_view
from lambent.core.views.camera import Camera
from lambent.realtime.frame_state import FrameState
from lambent.realtime.planar.planar_view import MARGIN_PX, STEP_PX, covered_share, on_screen, planar_views
from lambent.realtime.planar.reflector_faces import ReflectorFaces, shares_on_screen
from lambent.realtime.renderer import Renderer
from lambent.store.contract import ReflectorPart, ReflectorRecord
from tests.realtime.planar.test_realtime_planar import CAMERA, FLOOR, frame_of, mirror, scene_of, state

WIDTH, HEIGHT = 960, 640


TRAY = ReflectorRecord(
    plane=(0, 1, 0, 0),
    outline=((-0.2, 0, -0.2), (-0.2, 0, 0.2), (0.2, 0, 0.2), (0.2, 0, -0.2)),
    parts=(ReflectorPart(object="tray", faces=(0, 1), area_m2=0.16),),
)


def test_a_small_reflector_has_a_small_part_of_the_whole_buffer(monkeypatch: Any) -> None:
    """Its texels are those of the whole buffer, blocks of a coarse level included; a frame's pixels keep their rays."""
    frame, lobes = frame_of(CAMERA, WIDTH, HEIGHT), {"tray": 0.02}
    (part,) = planar_views(frame, [TRAY], WIDTH, HEIGHT, 4, lobes)
    monkeypatch.setattr(
        lambent.realtime.planar.planar_view, "_window", partial(_whole, lambent.realtime.planar.planar_view._window)
    )
    (whole,) = planar_views(frame, [TRAY], WIDTH, HEIGHT, 4, lobes)
    assert np.prod(part.size) < 0.3 * np.prod(whole.size)
    moved = whole.uniform["offset"] - part.uniform["offset"]
    assert np.all(moved % STEP_PX == 0) and np.all(moved >= 0)
    assert np.all(moved + np.array(part.size) <= whole.size)
    shown = (on_screen(frame, np.array(TRAY.outline)) * [1, -1] + 1) / 2 * [WIDTH, HEIGHT] + part.uniform["offset"]
    assert np.all(shown >= MARGIN_PX) and np.all(shown <= np.array(part.size) - MARGIN_PX)
    for name in ("plane", "eye"):
        np.testing.assert_array_equal(part.uniform[name], whole.uniform[name])
    rays = [
        view.frame["forward"] + x * view.frame["across"] + y * view.frame["up"]
        for view in (part, whole)
        for x, y in [(np.array([300.0, 200.0]) + view.uniform["offset"]) / view.size * [2, -2] + [-1, 1]]
    ]
    np.testing.assert_allclose(rays[0][:3], rays[1][:3], atol=1e-5)


@pytest.mark.long
def test_a_tray_is_as_with_the_whole_buffer(device: Any, monkeypatch: Any) -> None:
    """Where its lobe reaches no farther than the window, to the bit; wide lobes find their tails in the probe."""
    baked = scene_of(mirror(0.3))
    narrow = baked.record.model_copy(update={"reflectors": (FLOOR.model_copy(update={"outline": TRAY.outline}),)})
    renderer = Renderer(device, replace(baked, record=narrow))
    state = FrameState(CAMERA, 480, 320, antialias=False, show="specular", n=5)
    part = renderer.image(state)
    monkeypatch.setattr(
        lambent.realtime.planar.planar_view, "_window", partial(_whole, lambent.realtime.planar.planar_view._window)
    )
    whole = renderer.image(state)
    shown = (on_screen(frame_of(CAMERA, 480, 320), np.array(TRAY.outline)) * [1, -1] + 1) / 2 * [480, 320]
    (left, top), (right, bottom) = shown.min(axis=0).astype(int) + 4, shown.max(axis=0).astype(int) - 4
    middle = np.s_[(top + bottom) // 2 - 8 : (top + bottom) // 2 + 8, (left + right) // 2 - 8 : (left + right) // 2 + 8]
    assert whole[middle].max() > 0.1
    assert np.abs(part - whole)[middle].mean() < 0.03 * whole[middle].mean()


def _whole(window: Any, frame: Any, size: Any, m: float, shown: Any, step: int) -> Any:
    return window(frame, size, m, np.array([[-1.0, -1.0], [1.0, 1.0]]), step)


def test_a_tile_that_shares_a_lobe_needs_fewer_samples() -> None:
    rough, smooth = mirror(0.3), mirror(0.03)
    shared = FrameState(CAMERA)
    assert shared.planar_samples(rough) < shared.samples(rough)
    assert shared.planar_samples(smooth) == shared.samples(smooth)
    assert FrameState(CAMERA, n=19).planar_samples(rough) == 19, "what is asked for"


AHEAD = Camera(name="c", position=(0, 0, 3), target=(0, 0, 0), fov_y_deg=60)


def test_triangles_are_cut_at_the_frame_and_before_the_eye() -> None:
    rng = np.random.default_rng(3)
    triangles = rng.normal(size=(400, 1, 3)) * 2 + rng.normal(size=(400, 3, 3)) * rng.uniform(0.1, 6, (400, 1, 1))
    expected = [covered_share(on_screen(frame_of(AHEAD), one)) for one in triangles]
    assert 0.2 < np.mean(np.array(expected) > 0) < 0.95, "some are out of view"
    assert max(expected) > 0.5
    np.testing.assert_allclose(shares_on_screen(frame_of(AHEAD), triangles), expected, atol=1e-9)


def test_scattered_faces_get_no_view_for_what_lies_between_them(device: Any) -> None:
    """The outline of the floor fills half of the frame; all but a speck of its faces is gone."""
    scene = scene_of(mirror(0.05))
    (floor,) = [o for o in scene.record.objects if o.name == "floor"]
    (whole,) = ReflectorFaces(scene).shares(frame_of(CAMERA))
    assert whole > 0.2
    corners = scene.faces[floor.first_face : floor.first_face + floor.face_count]
    positions = scene.positions.copy()
    centre = positions[corners].mean(axis=(0, 1))
    positions[np.unique(corners)] = centre + 0.002 * (positions[np.unique(corners)] - centre)
    speck = replace(scene, positions=positions)
    assert 0 < ReflectorFaces(speck).shares(frame_of(CAMERA))[0] < 1e-4
    renderer = Renderer(device, speck)
    renderer.draw(state())
    assert renderer.statistics["mirrors"] == 0
