"""Light fields whose maps are taken without their object: of a volume, and of glass that refracts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baked.light_fields.light_field import LightField
from lambent.baked.light_fields.stored import read_light_field
from lambent.baking.bake import bake
from lambent.baking.light_fields.volume import volume_points
from lambent.baking.quality import Quality
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.errors import UserError
from lambent.core.geometry.octahedral import texel_directions
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import box
from lambent.scenes.scene import LightFieldWish, Scene, SceneObject
from lambent.store.store import Store
from tests.baking.small_scenes import TINY, coloured_room

SMALL = TINY.changed("small", light_field={"points": 32, "texels": 14, "strata": 1})
THICK = 0.02
GLASS = Material(name="glass", lobes=(Lobe(side="transmission", mx=0.002, my=0.002, k=0.9, r0=0.04, alpha=0.5),))


def baked(scene: Scene, folder: Path, quality: Quality = SMALL, **more: Any) -> Store:
    return bake(scene, folder, quality=quality, only=("light_field",), **more)


def sees_walls_alone(field: LightField) -> bool:
    """Whether all maps see the walls, 2 m from the middle along an axis, and nothing before them."""
    w, p = texel_directions(field.inverse_distance.shape[1]), field.points.astype(float)[:, None, None]
    w = np.where(np.abs(w) < 1e-12, 1e-12, w)
    wall = ((np.sign(w) * 2 - p) / w).min(axis=-1)
    return bool(np.allclose(field.inverse_distance * wall, 1, rtol=0.05))


def test_points_fill_the_box_and_see_past_the_object(tmp_path: Path) -> None:
    scene = replace(coloured_room(), light_fields={"ball": LightFieldWish(volume=True)})
    field = read_light_field(baked(scene, tmp_path / "s"), "ball")
    low, high = scene.object("ball").mesh.bounds
    margin = (high - low).max() / 8
    assert field.volume and field.without_object and len(field.points) == 32
    assert (field.points > low - margin).all() and (field.points < high + margin).all()
    within = np.linalg.norm(field.points, axis=1) < 0.9 * np.linalg.norm(high - low) / 2 / np.sqrt(3)
    assert 0.1 < within.mean() < 0.6, "in the object's own place, too"
    assert sees_walls_alone(field)


def test_points_behind_other_things_are_left_out(mi: Any) -> None:
    """The box stands on a plate: none is below it, or within a block that cuts into the box."""

    def block(name: str, size: tuple[float, ...], at: tuple[float, ...]) -> SceneObject:
        mesh = box(size)
        return SceneObject(name, replace(mesh, positions=(mesh.positions + np.array(at)).astype(np.float32)), "glass")

    stone = Material(name="glass", kd=0.5)
    table = block("table", (4, 0.1, 4), (0, -0.05, 0))
    post = block("post", (0.4, 1.4, 0.4), (0.5, 0.7, 0.0))
    scene = Scene("s", (table, post, block("hero", (1, 1, 1), (0, 0.5, 0))), {"glass": stone})
    builder = SceneBuilder(scene)
    points = volume_points(builder, scene.object("hero").mesh, "hero", 200).positions
    assert len(points) > 150 and points[:, 1].min() > 0
    assert not ((np.abs(points[:, 0] - 0.5) < 0.19) & (np.abs(points[:, 2]) < 0.19) & (points[:, 1] < 1.39)).any()


def pane_room() -> Scene:
    room = coloured_room()
    pane = SceneObject("pane", box((0.8, 0.6, THICK)), "glass")
    return replace(
        room, objects=(*room.objects[:-1], pane), materials={**room.materials, "glass": GLASS},
        light_fields={"pane": LightFieldWish(refracts=True)},
    )  # fmt: skip


@pytest.mark.long
def test_glass_knows_the_face_behind_each_place(tmp_path: Path) -> None:
    store = baked(pane_room(), tmp_path / "s")
    field = read_light_field(store, "pane")
    glass = field.glass
    assert glass is not None and sees_walls_alone(field)
    assert glass.eta == pytest.approx(1.5) and glass.power == 0
    np.testing.assert_allclose(glass.tint, 0.9 * 0.96)
    there = glass.exits[..., 3] >= 0
    thin = there & (glass.exits[..., 3] < 0.1)
    assert thin.mean() > 0.3
    np.testing.assert_allclose(glass.exits[thin][:, 3], THICK, rtol=0.01)
    np.testing.assert_allclose(np.abs(glass.exits[thin][:, :3]), np.broadcast_to([0, 0, 1], (thin.sum(), 3)), atol=1e-3)
    first = baked(pane_room(), tmp_path / "s")
    assert {a.name: a.key for a in first.artefacts()} == {a.name: a.key for a in store.artefacts()}
    gone = baked(replace(pane_room(), light_fields={"pane": LightFieldWish()}), tmp_path / "s")
    assert not [a.name for a in gone.artefacts() if a.name.endswith("exits")]
    assert read_light_field(gone, "pane").glass is None


def test_what_transmits_nothing_cannot_refract(tmp_path: Path) -> None:
    scene = replace(coloured_room(), light_fields={"ball": LightFieldWish(refracts=True)})
    with pytest.raises(UserError, match=r"light_field of ball.*transmits nothing.*leave out `refracts`"):
        baked(scene, tmp_path / "s")
    assert not Store.open(tmp_path / "s").artefacts("light_field")
