"""Copies of meshes share pieces and charts; each keeps its own place in the light map."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baking.surfaces.atlas import unwrap
from lambent.baking.surfaces.copies import STEP, copies_of
from lambent.baking.surfaces.parametrization import Laid, Triangles, laid_flat
from lambent.core.arrays import Floats
from lambent.materials.document import Material
from lambent.scenes.geometry import box, sphere, transformed
from lambent.scenes.scene import Scene, SceneObject


def matrix(
    scale: Floats | float = 1.0, at: Floats | tuple[float, float, float] = (0, 0, 0), turn: float = 0.0
) -> Floats:
    c, s = np.cos(turn), np.sin(turn)
    found = np.eye(4)
    found[:3, :3] = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ np.diag(np.broadcast_to(scale, 3))
    found[:3, 3] = at
    return found


def test_copies_are_meshes_moved_turned_and_scaled_evenly() -> None:
    mesh = sphere(0.3, 12, 8)
    others = [matrix(2.0, (3, 1, 40), 0.7), matrix((1.0, 1.2, 1.0)), matrix((-1.0, 1.0, 1.0)), matrix(0.5)]
    found = copies_of([mesh, *(transformed(mesh, m) for m in others), box((1, 1, 1)), box((2, 2, 2))])
    assert found.first.tolist() == [0, 0, 2, 3, 0, 5, 5]
    assert np.allclose(found.scale, [1, 2, 1, 1, 0.5, 1, 2], rtol=1e-4)
    assert found.shared.tolist() == [True, True, False, False, True, True, True]


def test_texels_of_copies_come_in_steps_and_those_of_others_do_not() -> None:
    ball = sphere(0.3, 12, 8)
    found = copies_of([ball, transformed(ball, matrix(2.0)), box((1, 1, 1))])
    sizes = np.array([0.051, 0.102, 0.051])
    stepped = found.stepped(np.arange(3), sizes)
    assert stepped[1] == pytest.approx(2 * stepped[0]) and stepped[2] == sizes[2]
    assert np.abs(np.log(stepped / sizes)).max() <= np.log(STEP) / 2 + 1e-9


def test_objects_of_one_mesh_are_unwrapped_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """600 objects of three meshes ask xatlas for three, and every object keeps a place of its own and its shape."""
    count = 600
    meshes = [box((0.2, 0.1, 0.3)), sphere(0.1, 10, 6), box((0.05, 0.4, 0.05))]
    rng = np.random.default_rng(5)
    places = [matrix(rng.uniform(0.7, 1.4), rng.uniform(-20, 20, 3), rng.uniform(0, 2 * np.pi)) for _ in range(count)]
    objects = (SceneObject(f"o{i}", transformed(meshes[i % 3], place), "m") for i, place in enumerate(places))
    scene = Scene("many", tuple(objects), {"m": Material()})
    asked = []

    def counting(meshes: list[Triangles]) -> list[Laid]:
        asked.extend(meshes)
        return laid_flat(meshes)

    monkeypatch.setattr("lambent.baking.surfaces.charts.laid_flat", counting)
    atlas = unwrap(scene, 448)
    assert len(asked) == len(meshes)
    taken = np.full((atlas.height, atlas.width), -1)
    for number, o in enumerate(atlas.scene.objects):
        uv = atlas.uv2[o.name] * (atlas.width, atlas.height)
        column, row = np.floor(uv[o.mesh.faces].mean(axis=1)).astype(int).T
        assert np.isin(taken[row, column], (-1, number)).all(), "two objects share a texel"
        taken[row, column] = number
    first, later = (atlas.scene.objects[i].mesh for i in (1, 1 + 3 * 100))
    assert first.faces.shape == later.faces.shape and len(first.positions) == len(later.positions)
    source = scene.objects[1 + 3 * 100].mesh
    assert np.array_equal(later.corners, source.corners), "faces keep their order and their places"
