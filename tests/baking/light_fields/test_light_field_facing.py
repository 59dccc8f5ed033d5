"""Which side of an object viewers see, and where its points stand then."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baked.light_fields.light_field import NO_POINT
from lambent.baked.light_fields.stored import read_light_field
from lambent.baking.bake import bake
from lambent.baking.light_fields.facing import side_seen, turned_to_viewers
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.views.camera import Camera
from lambent.scenes.scene import LightFieldWish, Scene
from tests.baking.small_scenes import TINY, coloured_room, turned_inwards

SMALL = TINY.changed("small", light_field={"points": 24, "texels": 16, "strata": 1})
EYES = (Camera("a", (1.5, 0.2, 1.2), (0, 0, 0)), Camera("b", (-1.4, -0.3, 1.0), (0, 0, 0)))


def inverted(scene: Scene) -> Scene:
    """The ball's normals point inwards."""
    ball = scene.object("ball")
    return replace(scene, objects=(*scene.objects[:-1], replace(ball, mesh=turned_inwards(ball.mesh))))


def test_normals_that_point_away_from_viewers_are_known(mi: Any) -> None:
    eyes = np.array([camera.position for camera in EYES])
    for scene, side in ((coloured_room(), 1.0), (inverted(coloured_room()), -1.0)):
        mesh, built = scene.object("ball").mesh, SceneBuilder(scene).build()
        assert side_seen(mesh, eyes, built, 0) == side
        assert side_seen(mesh, np.zeros((0, 3)), built, 0) == 1.0, "without viewers normals are believed"
        turned = turned_to_viewers(mesh, eyes, built, 0)
        assert (np.sum(turned.normals * turned.positions, axis=1) > 0).all()


@pytest.mark.long
def test_points_of_an_inverted_object_stand_on_the_side_that_is_seen(tmp_path: Path) -> None:
    scene = replace(inverted(coloured_room()), cameras=EYES, light_fields={"ball": LightFieldWish()})
    field = read_light_field(bake(scene, tmp_path / "s", quality=SMALL, only=("light_field",)), "ball")
    assert (np.linalg.norm(field.points, axis=1) > 0.28).all(), "the ball has flat faces"
    assert (np.sum(field.points * field.normals, axis=1) > 0).all()
    assert (field.sample_map[..., 0] != NO_POINT).mean() > 0.5
    assert (np.asarray(field.radiance).max(axis=-1) > 0.2).mean() > 0.4, "half of what points see are walls"
