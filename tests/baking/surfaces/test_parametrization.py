"""xatlas in a process of its own: what that process may do, and what becomes of meshes that end it."""

from __future__ import annotations

import subprocess
from typing import Any

import numpy as np
import pytest

from lambent.baking.surfaces import charts, parametrization
from lambent.baking.surfaces.atlas import merged, unwrap
from lambent.baking.surfaces.parametrization import Triangles, laid_flat
from lambent.core.geometry.triangles import triangle_areas
from lambent.scenes.geometry import box, sphere
from lambent.scenes.scene import Mesh
from tests.baking.small_scenes import room_with_step


def triangles(mesh: Mesh) -> Triangles:
    return mesh.positions.astype(np.float32), mesh.faces.astype(np.uint32), mesh.normals.astype(np.float32)


BOX, BALL = triangles(box((1, 1, 1))), triangles(sphere(1.0, 12, 8))


def test_triangles_keep_their_order_and_charts_share_no_vertices() -> None:
    for (source, faces, uv), (_, expected, _) in zip(laid_flat([BOX, BALL]), (BOX, BALL), strict=True):
        assert np.array_equal(source[faces], expected)
        assert uv.shape == (len(source), 2) and np.isfinite(uv).all()
    assert laid_flat([]) == []


def test_a_process_that_dies_is_started_again(monkeypatch: pytest.MonkeyPatch) -> None:
    ended = []

    def dying_first(command: list[str], **options: Any) -> subprocess.CompletedProcess[bytes]:
        done = subprocess.CompletedProcess[bytes](command, -11) if len(ended) < 2 else run(command, **options)
        ended.append(done.returncode)
        return done

    run, expected = subprocess.run, laid_flat([BOX])
    monkeypatch.setattr(parametrization.subprocess, "run", dying_first)
    assert all(np.array_equal(a, b) for a, b in zip(laid_flat([BOX])[0], expected[0], strict=True))
    assert ended == [-11, -11, 0]


def test_a_mesh_that_ends_the_process_leaves_the_others_alone() -> None:
    broken = (BOX[0], BOX[1] + 10**6, BOX[2])
    first, second, third = laid_flat([BOX, broken, BALL])
    for (source, faces, uv), (_, expected, _) in ((first, BOX), (third, BALL)):
        assert np.array_equal(source[faces], expected) and np.isfinite(uv).all()
    assert np.array_equal(second[0][second[1]], broken[1]) and np.isnan(second[2]).all()


def test_what_xatlas_cannot_lay_flat_is_projected(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(meshes: list[Triangles]) -> list[parametrization.Laid]:
        return [(source, faces, np.full_like(uv, np.nan)) for source, faces, uv in laid_flat(meshes)]

    scene = room_with_step()
    monkeypatch.setattr(charts, "laid_flat", failing)
    atlas = unwrap(scene, 128)
    arrays = merged(atlas)
    expected = np.concatenate([o.mesh.positions[o.mesh.faces] for o in scene.objects]).astype(np.float32)
    assert np.array_equal(arrays["positions"][arrays["faces"]], expected)
    corners = arrays["uv2"][arrays["faces"]] * (atlas.width, atlas.height)
    per_area = triangle_areas(np.pad(corners, ((0, 0), (0, 0), (0, 1)))) / triangle_areas(expected)
    assert per_area.min() > 0.55 * np.median(per_area), "a projection along an axis keeps at least 1 / sqrt(3)"
