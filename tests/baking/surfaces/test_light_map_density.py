"""How large the texels of a light map are, how its charts are packed, and large triangles cut near viewers."""

from __future__ import annotations

import logging
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.engine import engine
from lambent.baking.surfaces.atlas import Atlas, merged, unwrap
from lambent.baking.surfaces.coverage import texel_areas
from lambent.baking.surfaces.cuts import cut_for_viewers, longest_piece
from lambent.baking.surfaces.cutting import cut, lengths_of
from lambent.baking.surfaces.texels import texels_of
from lambent.baking.surfaces.visible_triangles import TriangleVisibility
from lambent.core.geometry.triangles import cross_2d, triangle_areas
from lambent.core.views.camera import Camera
from lambent.scenes.geometry import box, merge, patch, placed, sphere
from lambent.scenes.scene import Mesh, Scene, SceneObject
from lambent.store.store import Store
from tests.baking.small_scenes import GREY, TINY, turned_inwards

EYE = Camera("eye", (0, 1.6, 0), (0, 1.2, -2))


def room_on_a_plain(half_m: float) -> Scene:
    """A room of 6 x 3 x 6 m without a floor, with a chest, on a square plain of two triangles."""
    walls = placed(turned_inwards(box((6, 3, 6))), (0, 1.5, 0))
    down = (walls.positions[walls.faces][..., 1] < 0.1).all(axis=1)
    objects = (
        SceneObject("plain", patch((-half_m, 0, half_m), (2 * half_m, 0, 0), (0, 0, -2 * half_m)), "grey"),
        SceneObject("walls", replace(walls, faces=walls.faces[~down]), "grey"),
        SceneObject("chest", placed(box((1, 0.6, 0.5)), (1, 0.3, -2)), "grey"),
        SceneObject("hill", placed(sphere(half_m / 20, 24, 12), (0, 0, -half_m / 2)), "grey"),
    )
    return Scene("plain", objects, {"grey": GREY}, cameras=(EYE,))


def texels_of_objects(atlas: Atlas) -> dict[str, tuple[float, float]]:
    """By object: texels, and the size of the finest in metres."""
    found = {}
    for o in atlas.scene.objects:
        corners = atlas.uv2[o.name][o.mesh.faces].astype(float) * (atlas.width, atlas.height)
        in_map = np.abs(cross_2d(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])) / 2
        finest = np.sqrt(triangle_areas(o.mesh.corners.astype(float)) / np.maximum(in_map, 1e-9)).min()
        found[o.name] = float(in_map.sum()), float(finest)
    return found


def seen_atlas(scene: Scene, folder: Path) -> Atlas:
    engine()
    from lambent.baking.tracing.seen.viewed import texel_sizes

    with Store.create(folder / "s", {}) as store:
        sight = cut_for_viewers(TriangleVisibility(scene), store)
        return unwrap(sight.scene, 128, sizes=partial(texel_sizes, sight), longest_m=longest_piece(store))


@pytest.mark.parametrize("half_m", [100.0, 25_000.0])
def test_a_plain_leaves_texels_to_the_room_that_stands_on_it(half_m: float, tmp_path: Path) -> None:
    """Even texels would leave the walls one or none; the floor, the part of the plain within, is as fine as they."""
    scene = room_on_a_plain(half_m)
    even, seen = (texels_of_objects(atlas) for atlas in (unwrap(scene, 128), seen_atlas(scene, tmp_path)))
    total = sum(count for count, _ in seen.values())
    assert even["plain"][0] > 0.9 * sum(count for count, _ in even.values())
    assert seen["plain"][0] < 0.6 * total and seen["walls"][0] > 0.25 * total
    assert seen["plain"][1] < 2 * seen["walls"][1] and seen["walls"][1] < 0.25
    assert seen["hill"][0] < 0.1 * total, "it is seen by no one"


def test_an_object_whose_texels_are_too_coarse_is_named(caplog: pytest.LogCaptureFixture) -> None:
    engine()
    from lambent.baking.tracing.seen.viewed import texel_sizes

    with caplog.at_level(logging.WARNING):
        uncut = room_on_a_plain(100.0)
        unwrap(uncut, 128, sizes=partial(texel_sizes, TriangleVisibility(uncut)))
    assert len(caplog.messages) == 1
    assert caplog.messages[0].startswith("plain: its texels in the light map are ") and "cut it" in caplog.messages[0]
    assert "light_map_scale = " in caplog.messages[0]


def test_a_scene_without_cameras_has_even_texels(tmp_path: Path) -> None:
    scene = replace(room_on_a_plain(4.0), cameras=())
    seen = seen_atlas(scene, tmp_path)
    assert all(np.array_equal(seen.uv2[name], uv2) for name, uv2 in unwrap(scene, 128).uv2.items())


def test_cuts_leave_no_gaps_and_stay_with_the_store(tmp_path: Path) -> None:
    plain = room_on_a_plain(1000.0).objects[0].mesh
    eyes = np.array([[0.0, 1.6, 0.0]])
    mesh = cut(plain, eyes, 5.0)
    corners = mesh.corners.astype(float)
    middles = corners.mean(axis=1)
    assert triangle_areas(corners).sum() == pytest.approx(4e6, rel=1e-6) and len(mesh.faces) < 2000
    assert (lengths_of(corners) <= np.maximum(5, np.linalg.norm(middles - eyes, axis=1))).all()
    _, place = np.unique(mesh.positions, axis=0, return_inverse=True)
    ends = place.reshape(-1)[mesh.faces.astype(int)]
    edges = np.sort(np.concatenate([ends[:, :2], ends[:, 1:], ends[:, ::2]]), axis=1)
    edges, uses = np.unique(edges, axis=0, return_counts=True)
    ends = mesh.positions[np.unique(place, return_index=True)[1]][edges]
    outer = (np.abs(np.abs(ends) - 1000) < 1e-3).any(axis=2)
    assert (uses[~outer.all(axis=1)] == 2).all(), "an edge within the plain belongs to two triangles"
    assert np.allclose(mesh.normals, (0, 1, 0)) and np.allclose(np.linalg.norm(mesh.tangents, axis=1), 1, atol=1e-6)
    scene = room_on_a_plain(1000.0)
    with Store.create(tmp_path / "s", {}) as store:
        first = cut_for_viewers(TriangleVisibility(scene), store).scene
        moved = replace(scene, cameras=(replace(EYE, position=(400.0, 1.6, 400.0)),))
        assert np.array_equal(
            cut_for_viewers(TriangleVisibility(moved), store).scene.objects[0].mesh.faces, first.objects[0].mesh.faces
        )
        assert len(first.objects[0].mesh.faces) > 100 and first.objects[2] is scene.objects[2]


def confetti(count: int, radius: float, seed: int = 0) -> Mesh:
    """Discs of ten triangles each, anywhere in a cube of a metre and turned anyhow; no two share a vertex."""
    rng = np.random.default_rng(seed)
    turned = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    angle = np.arange(10) * np.pi / 5
    rim = radius * (np.cos(angle)[:, None] * turned[:, None, 0] + np.sin(angle)[:, None] * turned[:, None, 1])
    positions = np.concatenate([np.zeros((count, 1, 3)), rim], axis=1) + rng.random((count, 1, 3))
    fan = np.array([[0, 1 + i, 1 + (i + 1) % 10] for i in range(10)])
    faces = (fan + 11 * np.arange(count)[:, None, None]).reshape(-1, 3).astype(np.uint32)
    normals, tangents = (np.repeat(turned[:, i], 11, axis=0).astype(np.float32) for i in (2, 0))
    return Mesh(positions.reshape(-1, 3).astype(np.float32), normals, tangents, normals[:, :2].copy(), faces)


def scene_of(*meshes: Mesh) -> Scene:
    return Scene("m", tuple(SceneObject(f"o{i}", mesh, "grey") for i, mesh in enumerate(meshes)), {"grey": GREY})


@pytest.mark.long
@pytest.mark.parametrize(("resolution", "count"), [(96, 1500), (256, 20)])
def test_charts_fill_the_map(resolution: int, count: int) -> None:
    """Texels that lie on surfaces, whether charts are large, of a few texels, or smaller than one and merged."""
    mesh = confetti(count, 0.03)
    atlas = unwrap(scene_of(mesh, patch((0, -1, 0), (1, 0, 0), (0, 0, -2))), resolution)
    arrays = merged(atlas)
    held = len(texels_of(arrays, atlas.width, atlas.height).index) / (atlas.width * atlas.height)
    assert held > 0.75
    assert atlas.width * atlas.height < 2.5 * resolution**2
    assert texel_areas(arrays, atlas.width, atlas.height).sum() == pytest.approx(
        triangle_areas(scene_of(mesh).corners).sum() + 2, rel=0.02
    )


def test_no_texel_is_shared_by_charts_of_two_objects() -> None:
    meshes = [confetti(60, 0.05, seed) for seed in range(3)] + [sphere(0.4, 24, 12), box((0.5, 0.02, 0.02))]
    atlas = unwrap(scene_of(*meshes), 96)
    owner = np.full(atlas.width * atlas.height, -1)
    for number, o in enumerate(atlas.scene.objects):
        alone = merged(Atlas(replace(atlas.scene, objects=(o,)), atlas.uv2, atlas.width, atlas.height))
        index = texels_of(alone, atlas.width, atlas.height).index
        assert (owner[index] == -1).all()
        owner[index] = number


def test_long_strips_around_a_room_share_charts() -> None:
    """A cornice of triangles that share no vertex: 16 strips of a few millimetres along each of four walls."""
    feet = [np.array(p, float) for p in ((0, 0), (5, 0), (5, 4), (0, 4))]
    strips = []
    for i, (a, b) in enumerate(zip(feet, [*feet[1:], feet[0]], strict=True)):
        inwards = np.array([[0, 1], [-1, 0], [0, -1], [1, 0]][i]) * 0.005
        for k in range(16):
            low = np.array([*(a + k * inwards), 2.5 + 0.005 * k])[[0, 2, 1]]
            strips.append(patch(low, (b - a)[[0, 0, 1]] * (1, 0, 1), (inwards[0], 0.005, inwards[1])))
    mesh = merge(strips)
    atlas = unwrap(scene_of(mesh, patch((0, 0, 4), (5, 0, 0), (0, 0, -4))), 256)
    assert atlas.width * atlas.height < 1.5 * 256**2


def test_a_bake_has_the_texels_that_viewers_need(tmp_path: Path) -> None:
    store = bake(room_on_a_plain(100.0), tmp_path / "s", quality=TINY, only=["geometry"])
    assert store.documents["cuts"]["objects"] == ["plain"]
    faces = {o["name"]: o["face_count"] for o in store.documents["scene"]["objects"]}
    assert faces["plain"] > 50 and faces["chest"] == len(room_on_a_plain(100.0).objects[2].mesh.faces)
    again = bake(room_on_a_plain(100.0), tmp_path / "s", quality=TINY, only=["geometry"])
    assert again.documents["last_run"].keys() == {"other"}
