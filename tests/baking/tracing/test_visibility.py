"""Texels that lie across an occluder hold the light of the side in view."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.surfaces.texels import BEYOND, POINTS, Texels
from lambent.baking.tracing.rays import rays_from
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.baking.tracing.seen.visibility import seen, viewing_places, without_hidden
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.scenes.geometry import patch
from lambent.scenes.loaders.meshes.flush import with_flush_raised
from lambent.scenes.scene import ImageEnvironment, Scene, SceneObject
from tests.baking.small_scenes import TINY, constant_picture, room_with_step

OVER = 0.5  # metres that walls go on above the ceiling, and ceiling and floor beyond the walls
GREY = Material(kd=0.5)
SIDE = 2.0


def house(folder: Path) -> Scene:
    """A furnace of sheets (irradiance pi within) under a sky that puts a hundred times as much on what sticks out."""
    wide, tall = SIDE + 2 * OVER, SIDE + OVER
    low, high = -OVER, SIDE + OVER
    sheets = {
        "floor": patch((low, 0, high), (wide, 0, 0), (0, 0, -wide)),
        "ceiling": patch((low, SIDE, low), (wide, 0, 0), (0, 0, wide)),
        "back": patch((0, 0, 0), (SIDE, 0, 0), (0, tall, 0)),
        "front": patch((SIDE, 0, SIDE), (-SIDE, 0, 0), (0, tall, 0)),
        "left": patch((0, 0, SIDE), (0, 0, -SIDE), (0, tall, 0)),
        "right": patch((SIDE, 0, 0), (0, 0, SIDE), (0, tall, 0)),
    }
    objects = tuple(SceneObject(name, mesh, "grey", emission=(0.5, 0.5, 0.5)) for name, mesh in sheets.items())
    camera = Camera("inside", (1.0, 1.0, 1.0), (1.0, 1.0, 0.0))
    return Scene("house", objects, {"grey": GREY}, environment=ImageEnvironment(constant_picture(folder, 100.0)),
                 cameras=(camera,))  # fmt: skip


def looked_up(store, point: np.ndarray, name: str) -> float:
    """Irradiance as the renderer reads it: bilinear at the light map's coordinates of the nearest triangle's point."""
    from scipy.ndimage import map_coordinates

    image = store.read("light_map/irradiance").astype(float).mean(axis=2)
    record = next(o for o in store.documents["scene"]["objects"] if o["name"] == name)
    faces = store.read("geometry/faces")[record["first_face"] :][: record["face_count"]]
    p, uv2 = store.read("geometry/positions")[faces].astype(float), store.read("geometry/uv2")[faces].astype(float)
    for corners, places in zip(p, uv2, strict=True):
        edges = (corners[1:] - corners[0]).T
        weights, *_ = np.linalg.lstsq(edges, point - corners[0], rcond=None)
        if weights.min() >= -1e-6 and weights.sum() <= 1 + 1e-6:
            at = places[0] + weights @ (places[1:] - places[0])
            row, column = at[1] * image.shape[0] - 0.5, at[0] * image.shape[1] - 0.5
            return float(map_coordinates(image, [[row], [column]], order=1, mode="nearest")[0])
    raise AssertionError(f"{point} is not on {name}")


@pytest.mark.long
def test_light_from_above_the_ceiling_does_not_leak_down_the_wall(tmp_path: Path) -> None:
    store = bake(house(tmp_path), tmp_path / "s", quality=TINY.changed(geometry={"texels": 64}), only=["light_map"])
    inner = [np.array([x, SIDE - 1e-3, 0.0]) for x in np.linspace(0.1, 1.9, 13)]
    assert np.allclose([looked_up(store, p, "back") for p in inner], np.pi, rtol=0.1)
    corner = [np.array([x, 0.0, 1e-3]) for x in np.linspace(0.1, 1.9, 13)]
    assert np.allclose([looked_up(store, p, "floor") for p in corner], np.pi, rtol=0.1)
    outer = looked_up(store, np.array([1.0, SIDE + OVER - 1e-3, 0.0]), "back")
    assert outer > 30, "what no viewer sees keeps its own light"


def test_only_what_cameras_reach_is_seen(tmp_path: Path) -> None:
    scene = house(tmp_path)
    traced = SceneBuilder(scene).build()
    places = viewing_places(scene, traced)
    assert len(places) > 100 and (places > 0).all() and (places < SIDE).all()
    points = np.array([[1, 1, 0], [1, SIDE + 0.1, 0], [1, 0, 1], [1, 1, 0]], float)
    normals = np.array([[0, 0, 1], [0, 0, 1], [0, 1, 0], [0, 0, -1]], float)
    assert seen(traced, places, points, normals).tolist() == [True, False, True, False]
    assert not seen(traced, places[:0], points, normals).any()


@pytest.mark.long
def test_a_flush_poster_covers_its_wall_and_leaves_no_dark_border(tmp_path: Path) -> None:
    """Every ray meets the poster, grazing ones too; the wall beside it has the light of the furnace, pi."""
    bare = house(tmp_path)
    poster = SceneObject("poster", patch((0.5, 0.5, 0), (0.7, 0, 0), (0, 0.9, 0)), "paper", emission=(0.5, 0.5, 0.5))
    both = replace(bare, objects=(*bare.objects, poster), materials={"grey": GREY, "paper": Material(kd=0.5)})
    scene = with_flush_raised(both)
    assert "poster on back" in scene.warnings[0]
    builder = SceneBuilder(scene)
    u, v = np.meshgrid(np.linspace(0.53, 1.17, 60), np.linspace(0.53, 1.37, 60))
    for eye in ((1.0, 1.0, 1.9), (0.02, 1.0, 0.05), (1.99, 0.01, 0.01)):
        aims = np.stack([u, v, np.zeros_like(u)], axis=-1).reshape(-1, 3) - eye
        ray = rays_from(np.array(eye), aims / np.linalg.norm(aims, axis=1, keepdims=True))
        met = builder.build().ray_intersect_preliminary(ray, coherent=True)
        assert set(np.array(builder.numbers.at(met, met.is_valid())).tolist()) == {len(bare.objects)}, eye
    store = bake(scene, tmp_path / "s", quality=TINY.changed(geometry={"texels": 128}), only=["light_map"])
    for away in (1e-3, 4e-3, 0.02):
        left = [np.array([0.5 - away, y, 0.0]) for y in np.linspace(0.52, 1.38, 40)]
        above = [np.array([x, 1.4 + away, 0.0]) for x in np.linspace(0.52, 1.18, 40)]
        np.testing.assert_allclose([looked_up(store, p, "back") for p in (*left, *above)], np.pi, rtol=0.1)


@pytest.fixture(scope="module", autouse=True)
def variant() -> None:
    from lambent.baking.engine import engine

    engine()
    assert mi.variant()


def test_hidden_points_and_texels_by_hand() -> None:
    """A row of five texels of one chart: seen, half seen, and three hidden; then another chart."""
    index = np.arange(6)
    vectors = np.zeros((6, POINTS, 3), np.float32)
    texels = Texels(6, 1, index, np.zeros((6, POINTS), int), vectors, vectors, vectors, np.ones(6), np.ones(6))
    in_view = np.zeros((6, POINTS), bool)
    in_view[0], in_view[1, :2] = True, True
    labels = np.array([[3, 3, 3, 3, 3, 4]])
    valid, parted = without_hidden(texels, np.ones((6, POINTS), bool), in_view, labels)
    assert valid.sum(axis=1).tolist() == [4, 2, 0, 4, 4, 4]
    assert parted.tolist() == [[3, 3, 3, 3 + BEYOND, 3 + BEYOND, 4 + BEYOND]]
    everything, same = without_hidden(texels, np.ones((6, POINTS), bool), ~np.zeros((6, POINTS), bool), labels)
    assert everything.all() and (same == labels).all()


@pytest.mark.long
def test_a_side_on_which_nothing_is_lit_needs_no_rays(tmp_path: Path) -> None:
    """A camera in a room of closed bodies asks for the light of backs, of which there is none."""
    eye = Camera("eye", (0.6, 0.3, 0.8), (-0.8, -0.2, -0.4))
    store = bake(replace(room_with_step(), cameras=(eye,)), tmp_path / "s", quality=TINY, only=("light_map",))
    assert store.read("light_map/irradiance").mean() > 0
