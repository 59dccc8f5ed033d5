"""Screening of very many objects, and meshes cut along a plane: against answers known by hand and the exact test."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.baking.probes.hidden import hidden_share, seen_from, spread
from lambent.baking.probes.screening import hidden_shares, median_distances, widths
from lambent.baking.surfaces.cutting import cut_across
from lambent.baking.tracing.scene_builder import SceneBuilder, bare_scene
from lambent.baking.tracing.solids import closed
from lambent.core.geometry.triangles import triangle_areas
from lambent.scenes.geometry import box, merge, patch, placed, signed_volume, sphere
from lambent.scenes.scene import Mesh, Scene, SceneObject
from tests.baking.probes.test_probe_division import two_rooms
from tests.baking.small_scenes import GREY, MIRROR, turned_inwards


def rooms(doors: int = 1) -> Scene:
    """A ball in the middle of a room, and bars that reach through the wall to the room beside it."""
    both = two_rooms()
    shell, wall, bar, ball = (both.object(name) for name in ("shell", "wall", "bar", "ball"))
    bars = (replace(bar, name=f"bar{i}", mesh=placed(bar.mesh, (0, 0.5 * i, 0))) for i in range(doors))
    return replace(both, objects=(shell, wall, ball, *bars))


def screened(scene: Scene, names: list[str]) -> np.ndarray:
    order = [o.name for o in scene.objects]
    owner = np.repeat(np.arange(len(order)), [len(o.mesh.faces) for o in scene.objects])
    meshes, numbers = [scene.object(name).mesh for name in names], [order.index(name) for name in names]
    return hidden_shares(bare_scene(scene.corners), owner, meshes, numbers)


def test_few_rays_find_what_many_do(mi: Any) -> None:
    scene = rooms()
    ball, bar = screened(scene, ["ball", "bar0"])
    assert ball < 0.05 and bar > 0.15
    builder = SceneBuilder(scene)
    for name, found in (("ball", ball), ("bar0", bar)):
        without, mesh = builder.build(leave_out={name}), scene.object(name).mesh
        exact = hidden_share(seen_from(*spread(mesh, 4096), without), np.mean(mesh.bounds, axis=0), without)
        assert found == pytest.approx(exact, abs=0.05)


def test_each_of_many_is_judged_as_if_alone(mi: Any) -> None:
    """Others that are screened with it hide as they do in the scene, its own surface does not."""
    together = screened(rooms(3), ["ball", "bar0", "bar1", "bar2"])
    apart = [screened(rooms(3), [name])[0] for name in ("ball", "bar0", "bar1", "bar2")]
    np.testing.assert_allclose(together, apart, atol=0.04)
    assert len(screened(rooms(), [])) == 0


def test_an_object_within_itself_hides_nothing(mi: Any) -> None:
    """Rays from the inner ball of two go through the outer one: both are one object."""
    nested = merge([sphere(0.5, 24, 12), sphere(0.3, 24, 12)])
    scene = Scene("nested", (SceneObject("shell", turned_inwards(box((4, 4, 4))), "grey"),
                             SceneObject("nested", nested, "mirror")), {"grey": GREY, "mirror": MIRROR})  # fmt: skip
    assert screened(scene, ["nested"])[0] == pytest.approx(0, abs=1e-9)


def test_widths_and_median_distances(mi: Any) -> None:
    ball = sphere(0.3, 64, 48)
    assert widths([ball])[0] == pytest.approx(0.3 * np.sqrt(np.pi), rel=0.01)
    places = np.array([[0.0, 0, 3], [0, 0, 4], [0, 0, 50]])
    assert median_distances([ball], places)[0] == pytest.approx(4)


OBLIQUE = (0.3, 0.5, -0.7, 0.05)


@pytest.mark.parametrize("mesh", [box((1, 2, 3)), sphere(1.0, 24, 12), patch((-1, -1, 0), (2, 0, 0), (0, 2, 0))])
@pytest.mark.parametrize("plane", [OBLIQUE, (1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, -0.2)])
def test_no_face_has_two_sides_of_a_plane_after_a_cut(mesh: Mesh, plane: tuple[float, float, float, float]) -> None:
    cut = cut_across(mesh, plane)
    n, d = np.array(plane[:3]), plane[3]
    height = cut.corners @ n + d
    assert (height.min(axis=1) * height.max(axis=1)).min() > -1e-5
    assert triangle_areas(cut.corners).sum() == pytest.approx(triangle_areas(mesh.corners).sum(), rel=1e-5)
    assert signed_volume(cut) == pytest.approx(signed_volume(mesh), rel=1e-5, abs=1e-9)
    assert closed([cut])[0] == closed([mesh])[0]
    assert np.linalg.norm(cut.normals, axis=1) == pytest.approx(1, abs=1e-4)


def test_a_plane_beside_a_mesh_or_along_its_faces_cuts_nothing() -> None:
    for plane in ((1.0, 0.0, 0.0, -2.0), (1.0, 0.0, 0.0, -0.5), (5.0, 0.0, 0.0, 2.5)):
        assert len(cut_across(box((1, 1, 1)), plane).faces) == 12


def test_which_of_many_meshes_are_closed_is_found_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Open ones, one whose faces turn about, one with an edge of four faces, and a copy beside each other."""
    monkeypatch.setattr("lambent.scenes.mesh.TRIANGLES_AT_ONCE", 40)
    block, ball = box((1, 1, 1)), sphere(0.5, 8, 4)
    sheet = replace(block, faces=block.faces[:-1])
    turned = replace(block, faces=np.concatenate([block.faces[:-1], block.faces[-1:, ::-1]]))
    doubled = replace(block, faces=np.concatenate([block.faces, block.faces]))
    meshes = [block, sheet, ball, turned, placed(block, (1, 0, 0)), doubled, ball]
    assert closed(meshes).tolist() == [True, False, True, False, True, False, True]
    assert [bool(closed([mesh])[0]) for mesh in meshes] == closed(meshes).tolist()
