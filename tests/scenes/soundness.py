"""Tests that every built-in scene of closed things passes; a module that imports them has a fixture `scene` and a set
`OPEN` of objects that end in others, or are sheets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.materials.bsdf import MaterialBSDF
from lambent.scenes.geometry import signed_volume
from lambent.scenes.scene import Scene
from tests.scenes.test_geometry import boundary_edges


def test_closed_things_are_closed_and_the_right_side_out(scene: Scene, request: pytest.FixtureRequest) -> None:
    for o in scene.objects:
        if o.name not in request.module.OPEN:
            assert boundary_edges(o.mesh) == 0, o.name
            middle = np.mean(o.mesh.bounds, axis=0).astype(np.float32)
            assert signed_volume(replace(o.mesh, positions=o.mesh.positions - middle)) > 0, o.name


def test_materials_give_back_no_more_than_they_get(scene: Scene) -> None:
    theta = np.radians([0, 30, 60, 80])
    wo = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], axis=-1)
    for name, material in scene.materials.items():
        assert MaterialBSDF(material).albedo(wo).max() < 1.02, name
