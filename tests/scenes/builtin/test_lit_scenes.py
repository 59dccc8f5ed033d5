"""The scenes of interreflections: sound meshes, materials that open as curves, light that stays where it belongs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.core.geometry.triangles import triangle_areas
from lambent.core.plain import triple
from lambent.core.views.camera import Camera
from lambent.scenes import load_scene
from lambent.scenes.builtin import cornell, loft
from lambent.scenes.builtin.things import block
from lambent.scenes.scene import ConstantEnvironment, SceneObject


def mesh_of(objects: tuple[SceneObject, ...], name: str) -> Any:
    return next(o.mesh for o in objects if o.name == name)


def test_cornell_lamp_fills_the_hole_in_the_ceiling() -> None:
    scene = load_scene("builtin:cornell")
    lamp, ceiling = scene.object("lamp"), scene.object("ceiling")
    assert triangle_areas(lamp.mesh.corners).sum() == pytest.approx(0.13 * 0.105, rel=1e-5)
    together = triangle_areas(lamp.mesh.corners).sum() + triangle_areas(ceiling.mesh.corners).sum()
    assert together == pytest.approx(0.555 * 0.5592, rel=1e-5)
    assert lamp.emission == (18.4, 15.6, 10.4) and np.all(lamp.mesh.normals == (0, -1, 0))
    assert [o.name for o in scene.objects if any(o.emission)] == ["lamp"]


def test_cornell_boxes_have_the_measured_corners() -> None:
    """Corners of their tops in the published coordinates, millimetres; these have x to the left and z away."""
    published = {
        "small_box": (165, [(130, 65), (82, 225), (240, 272), (290, 114)]),
        "large_box": (330, [(423, 247), (265, 296), (314, 456), (472, 406)]),
    }
    for name, (height, corners) in published.items():
        positions = mesh_of(cornell.objects(), name).positions.astype(float)
        top = positions[positions[:, 1] > 0.1] * 1000
        assert top[:, 1] == pytest.approx(height, abs=1e-3)
        here = np.stack([277.5 - top[:, 0], 279.6 - top[:, 2]], axis=-1)
        for corner in corners:
            assert np.linalg.norm(here - corner, axis=-1).min() < 4, name  # the measured ones are not quite square


def test_cornell_floor_gets_the_light_of_a_rectangle(mi: Any) -> None:
    """Irradiance under the middle of a parallel rectangle (Howell, factor B-3), without interreflections."""
    from lambent.bake.reference.path_traced import render_reference

    scene = load_scene("builtin:cornell")
    bare = replace(
        scene,
        objects=tuple(o for o in scene.objects if o.name in ("floor", "lamp")),
        materials={**scene.materials, "floor": scene.materials["floor"].model_copy(update={"lobes": ()})},
    )
    down = Camera("down", (0.0, 0.1, 0.0), (0.0, 0.0, 0.0), up=(0.0, 0.0, -1.0), fov_y_deg=1.0)
    image, variance = render_reference(bare, down, 8, 8, 1024, max_depth=2)
    x, y = cornell.LAMP_X / cornell.HEIGHT, cornell.LAMP_Z / cornell.HEIGHT
    a, b = np.sqrt(1 + x * x), np.sqrt(1 + y * y)
    factor = 4 / (2 * np.pi) * (x / a * np.arctan(y / a) + y / b * np.arctan(x / b))
    irradiance = np.pi * np.array(scene.object("lamp").emission) * factor
    expected = irradiance * np.array(scene.materials["floor"].kd) / np.pi
    error = np.sqrt(variance.sum(axis=(0, 1))) / 64
    assert np.abs(image.mean(axis=(0, 1)) - expected).max() < 5 * error.max() + 1e-4 * expected.max()


def test_the_loft_is_lit_through_its_windows_alone(mi: Any) -> None:
    """No light comes in where the windows are closed, whichever way it falls."""
    from lambent.bake.reference.path_traced import render_reference

    scene = replace(load_scene("builtin:loft"), environment=ConstantEnvironment((1.0, 1.0, 1.0)))
    x = -loft.X - loft.THICK / 2
    y0, y1 = loft.WINDOW_Y
    shutters = [
        replace(
            scene.object("table"),
            name=f"shutter_{k}",
            mesh=block((x - 0.02, y0 - 0.05, z0 - 0.05), (x + 0.02, y1 + 0.05, z1 + 0.05)),
        )
        for k, (z0, z1) in enumerate(loft.WINDOWS_Z)
    ]
    here = np.array([0.2, 1.3, 0.6])
    lit = render_reference(scene, scene.cameras[0], 48, 36, 4, max_depth=3)[0]
    assert lit.mean() > 0.01
    closed = replace(scene, objects=(*scene.objects, *shutters))
    for looking in np.concatenate([np.eye(3), -np.eye(3)]) + 0.1:
        camera = Camera("in", triple(here), triple(here + looking), fov_y_deg=100.0)
        assert render_reference(closed, camera, 64, 64, 4, max_depth=3)[0].max() == 0
