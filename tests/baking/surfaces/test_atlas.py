"""Second texture coordinates and the surface points of texels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.baking.surfaces.atlas import merged, object_records, separated, unwrap
from lambent.baking.surfaces.charts import PIECE_FACES
from lambent.baking.surfaces.texels import chart_labels, texels_of
from lambent.core.geometry.triangles import cross_2d
from lambent.scenes.geometry import sphere
from lambent.scenes.scene import Scene, SceneObject
from tests.baking.small_scenes import plane, room_with_step


def triangles(scene: Scene) -> np.ndarray:
    return np.concatenate([o.mesh.positions[o.mesh.faces] for o in scene.objects])


@pytest.mark.long
def test_faces_keep_their_place_and_their_objects() -> None:
    scene = room_with_step()
    arrays = merged(unwrap(scene, 128))
    assert np.array_equal(arrays["positions"][arrays["faces"]], triangles(scene).astype(np.float32))
    assert arrays["uv2"].min() >= 0 and arrays["uv2"].max() <= 1
    records = object_records(scene)
    assert [r.first_face for r in records] == list(np.cumsum([0] + [r.face_count for r in records])[:-1])
    assert sum(r.face_count for r in records) == len(arrays["faces"])
    assert [r.name for r in records if r.probe] == ["ball"]


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[0] * b[:, 1] - a[1] * b[:, 0]


def test_no_texel_centre_lies_on_two_triangles() -> None:
    atlas = unwrap(room_with_step(), 128)
    arrays = merged(atlas)
    corners = arrays["uv2"][arrays["faces"]] * (atlas.width, atlas.height)
    x, y = np.meshgrid(np.arange(atlas.width) + 0.5, np.arange(atlas.height) + 0.5)
    points = np.stack([x, y], axis=-1).reshape(-1, 1, 2)
    covered = np.zeros(points.shape[0], int)
    for triangle in corners:
        sides = [cross(triangle[(i + 1) % 3] - triangle[i], points[:, 0] - triangle[i]) for i in range(3)]
        inside = np.all(np.array(sides) > 1e-6, axis=0) | np.all(np.array(sides) < -1e-6, axis=0)
        covered += inside
    assert covered.max() == 1


def test_unwrapping_is_deterministic_and_survives_the_store() -> None:
    scene = room_with_step()
    first, second = unwrap(scene, 128), unwrap(scene, 128)
    a, b = merged(first), merged(second)
    assert all(np.array_equal(a[name], b[name]) for name in a)
    again = separated(scene, a, first.width, first.height)
    for old, new in zip(first.scene.objects, again.scene.objects, strict=True):
        assert np.array_equal(old.mesh.faces, new.mesh.faces) and np.array_equal(old.mesh.tangents, new.mesh.tangents)
        assert np.array_equal(first.uv2[old.name], again.uv2[old.name])


@pytest.mark.long
def test_a_large_smooth_mesh_is_unwrapped_in_pieces() -> None:
    ball = sphere(1.0, 192, 160)  # in one piece it brings the unwrapper down
    assert len(ball.faces) > 10 * PIECE_FACES
    scene = replace(plane(), objects=(SceneObject("ball", ball, "black"),))
    assert len(merged(unwrap(scene, 128))["faces"]) == len(ball.faces)


def test_light_map_scale_gives_fewer_texels() -> None:
    floor = plane().objects[0]
    coarse = replace(floor, name="coarse", light_map_scale=0.25)
    atlas = unwrap(replace(plane(), objects=(floor, coarse)), 128)
    size = {name: np.ptp(uv2 * (atlas.width, atlas.height), axis=0).max() for name, uv2 in atlas.uv2.items()}
    assert size["coarse"] == pytest.approx(size["floor"] / 4, rel=0.1)


@pytest.mark.long
def test_texels_know_their_surface_point() -> None:
    atlas = unwrap(plane(), 64)
    arrays = merged(atlas)
    texels = texels_of(arrays, atlas.width, atlas.height)
    corners, uv2 = arrays["positions"], arrays["uv2"] * (atlas.width, atlas.height)
    to_world = np.linalg.lstsq(np.c_[uv2, np.ones(len(uv2))], corners, rcond=None)[0]
    row, column = np.divmod(texels.index, atlas.width)
    expected = np.c_[column + 0.5, row + 0.5, np.ones(len(row))] @ to_world
    inner = (np.abs(expected) < 0.95).all(axis=1)
    assert np.allclose(texels.positions.mean(axis=1)[inner], expected[inner], atol=1e-4), "points surround the centre"
    assert np.abs(texels.positions).max() <= 1 + 1e-6, "none leaves its triangle"
    assert np.allclose(texels.normals, (0, 1, 0)) and np.allclose(texels.flat, (0, 1, 0))


def test_every_texel_a_bilinear_look_up_touches_has_a_point() -> None:
    atlas = unwrap(room_with_step(), 96)
    arrays = merged(atlas)
    texels = texels_of(arrays, atlas.width, atlas.height)
    covered = np.zeros((atlas.height, atlas.width), bool)
    covered.reshape(-1)[texels.index] = True
    rng = np.random.default_rng(0)
    face = rng.integers(len(arrays["faces"]), size=5000)
    weights = rng.dirichlet((0.3, 0.3, 0.3), size=5000)
    uv2 = np.einsum("kcx,kc->kx", arrays["uv2"][arrays["faces"][face]], weights) * (atlas.width, atlas.height) - 0.5
    low = np.floor(uv2).astype(int)
    for step in ((0, 0), (0, 1), (1, 0), (1, 1)):
        column, row = (low + step).T
        assert covered[row.clip(0, atlas.height - 1), column.clip(0, atlas.width - 1)].all()


def test_charts_are_told_apart() -> None:
    atlas = unwrap(room_with_step(), 96)
    arrays = merged(atlas)
    labels = chart_labels(arrays, texels_of(arrays, atlas.width, atlas.height))
    assert labels.shape == (atlas.height, atlas.width) and (labels == -1).any()
    assert len(np.unique(labels)) > 13, "two boxes of six sides, the lamp and the ball"


def test_small_scenes_are_unwrapped_like_large_ones() -> None:
    """A fine ball of 3 mm has the light map of one of 3 m."""
    atlases = [
        unwrap(Scene("ball", (SceneObject("ball", sphere(radius, 48, 24), "grey"),), {}), 128)
        for radius in (3.0, 0.003)
    ]
    shares = []
    for atlas in atlases:
        corners = atlas.uv2["ball"][atlas.scene.objects[0].mesh.faces]
        shares.append(np.abs(cross_2d(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])).sum() / 2)
    assert shares[1] == pytest.approx(shares[0], rel=0.1) and shares[0] > 0.3
