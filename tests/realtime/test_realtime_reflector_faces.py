"""Reflectors are chosen by the share of a frame that their faces cover."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.core.views.camera import Camera
from lambent.realtime.planar.planar_view import covered_share, on_screen
from lambent.realtime.planar.reflector_faces import ReflectorFaces, outline_triangles, shares_on_screen
from lambent.realtime.renderer import Renderer
from tests.realtime.test_realtime_planar import CAMERA, FLOOR, frame_of, mirror, scene_of, state

AHEAD = Camera(name="c", position=(0, 0, 3), target=(0, 0, 0), fov_y_deg=60)


def test_triangles_are_cut_at_the_frame_and_before_the_eye() -> None:
    rng = np.random.default_rng(3)
    triangles = rng.normal(size=(400, 1, 3)) * 2 + rng.normal(size=(400, 3, 3)) * rng.uniform(0.1, 6, (400, 1, 1))
    expected = [covered_share(on_screen(frame_of(AHEAD), one)) for one in triangles]
    assert 0.2 < np.mean(np.array(expected) > 0) < 0.95, "some are out of view"
    assert max(expected) > 0.5
    np.testing.assert_allclose(shares_on_screen(frame_of(AHEAD), triangles), expected, atol=1e-9)


def test_an_outline_covers_what_its_triangles_do() -> None:
    outline = np.array(FLOOR.outline)
    shares = shares_on_screen(frame_of(CAMERA), outline_triangles(FLOOR))
    assert shares.sum() == pytest.approx(covered_share(on_screen(frame_of(CAMERA), outline)))


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


def test_a_reflector_has_its_view_as_soon_as_it_enters_the_frame(device: Any) -> None:
    """A camera that tilts down to the floor: from the first pixels on, its share grows without a step."""
    scene = scene_of(mirror(0.05))
    renderer, faces, shares = Renderer(device, scene), ReflectorFaces(scene), []
    for height in np.linspace(2.1, 1.3, 17):
        camera = replace(CAMERA, target=(0.1, float(height), 0.0))
        (share,) = faces.shares(frame_of(camera))
        renderer.draw(replace(state(), camera=camera))
        assert renderer.statistics["mirrors"] == (share >= 2e-4)
        shares.append(share)
    assert shares[0] < shares[-1]
    assert np.all(np.diff(shares) >= 0)
    assert np.diff(shares).max() < 0.05
