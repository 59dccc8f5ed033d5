"""Copies of meshes share pieces and charts; each keeps its own place in the light map."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest
import xatlas

from lambent.bake.surfaces.atlas import unwrap
from lambent.bake.surfaces.copies import STEP, copies_of
from lambent.core.arrays import Floats
from lambent.scenes import load_scene
from lambent.scenes.geometry import box, sphere, transformed
from lambent.scenes.scene import Mesh


def nodes_of_meshes(path: Path, meshes: list[Mesh], places: Floats) -> None:
    """A .glb in which node i shows mesh i modulo their number, at `places` (N, 5): x, y, z, turn in radians, scale."""
    views: list[dict[str, int]] = []
    accessors: list[dict[str, object]] = []
    data = b""

    def accessor(values: np.ndarray, kind: str, code: int) -> int:
        nonlocal data
        raw = np.ascontiguousarray(values).tobytes()
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(raw)})
        accessors.append({"bufferView": len(views) - 1, "componentType": code, "count": len(values), "type": kind})
        data += raw
        return len(accessors) - 1

    documents = [
        {"primitives": [{
            "attributes": {
                "POSITION": accessor(m.positions, "VEC3", 5126), "NORMAL": accessor(m.normals, "VEC3", 5126),
            },
            "indices": accessor(m.faces.astype(np.uint32).ravel(), "SCALAR", 5125),
        }]}
        for m in meshes
    ]  # fmt: skip
    nodes = [
        {"name": f"node{i}", "mesh": i % len(meshes), "translation": [x, y, z], "scale": [scale] * 3,
         "rotation": [0, float(np.sin(turn / 2)), 0, float(np.cos(turn / 2))]}
        for i, (x, y, z, turn, scale) in enumerate(places.tolist())
    ]  # fmt: skip
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes,
        "meshes": documents, "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(data)}],
    }  # fmt: skip
    text = json.dumps(document).encode()
    text, data = text + b" " * (-len(text) % 4), data + b"\0" * (-len(data) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    path.write_bytes(struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks)


def scattered(count: int) -> Floats:
    rng = np.random.default_rng(5)
    return np.concatenate([
        rng.uniform(-20, 20, (count, 3)), rng.uniform(0, 2 * np.pi, (count, 1)), rng.uniform(0.7, 1.4, (count, 1)),
    ], axis=1)  # fmt: skip


def matrix(scale: Floats | float = 1.0, at: tuple[float, float, float] = (0, 0, 0), turn: float = 0.0) -> Floats:
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


def test_nodes_of_one_mesh_are_unwrapped_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """2000 nodes of three meshes ask xatlas for three, and every object keeps a place of its own and its shape."""
    count = 2000
    meshes = [box((0.2, 0.1, 0.3)), sphere(0.1, 10, 6), box((0.05, 0.4, 0.05))]
    nodes_of_meshes(tmp_path / "many.glb", meshes, scattered(count))
    scene = load_scene(tmp_path / "many.glb")
    asked = []

    class Counting(xatlas.Atlas):  # type: ignore[misc]
        def add_mesh(self, *arrays: object) -> None:
            asked.append(1)
            super().add_mesh(*arrays)

    monkeypatch.setattr("lambent.bake.surfaces.charts.xatlas.Atlas", Counting)
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
