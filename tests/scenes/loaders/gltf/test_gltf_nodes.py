"""glTF's nodes and primitives: transforms that nest, strips, fans, second uv sets."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lambent.core.geometry.directions import normalize
from tests.scenes.loaders.gltf.test_gltf import TRIANGLE, TURNS, document, loaded, textured
from tests.scenes.loaders.pictures import png

OUTER = {"translation": [1, 2, 3], "rotation": TURNS[1], "scale": [2, 3, 4]}
INNER = {"translation": [-4, 1, 0.5], "rotation": TURNS[0], "scale": [0.5, 0.25, 1.5]}


def placed(points: np.ndarray, node: dict[str, Any]) -> np.ndarray:
    """Scaled, turned, then moved (glTF 2.0, 3.5.3)."""
    turned = Rotation.from_quat(node["rotation"]).apply(points * node["scale"])
    return turned + np.array(node["translation"])


def nested(**child: Any) -> list[dict[str, Any]]:
    return [{"children": [1], **OUTER}, {**INNER, **child}]


def test_a_childs_transform_comes_before_its_parents(tmp_path: Path) -> None:
    scene = loaded(tmp_path, document(nodes=nested(mesh=0, name="thing")))
    mesh = scene.object("thing").mesh
    corners = mesh.positions[mesh.faces[0]]
    start = int(np.argmin(np.linalg.norm(mesh.positions - placed(placed(TRIANGLE[:1], INNER), OUTER), axis=1)))
    expected = placed(placed(TRIANGLE.astype(float), INNER), OUTER)
    for point in expected:
        assert np.linalg.norm(corners - point, axis=1).min() < 1e-5
    assert np.allclose(mesh.positions[start], expected[0], atol=1e-5)
    normal = normalize(np.cross(expected[1] - expected[0], expected[2] - expected[0]))
    np.testing.assert_allclose(mesh.normals, np.tile(normal, (3, 1)), atol=1e-5)


def test_a_matrix_is_stored_by_columns(tmp_path: Path) -> None:
    matrix = [0, 0, -2, 0, 0, 3, 0, 0, 4, 0, 0, 0, 7, 8, 9, 1]  # x to -2 z, y to 3 y, z to 4 x
    scene = loaded(tmp_path, document(nodes=[{"mesh": 0, "name": "thing", "matrix": matrix}]))
    positions = scene.object("thing").mesh.positions
    for point in ((7, 8, 9), (7, 8, 7), (7, 11, 9)):
        assert np.linalg.norm(positions - point, axis=1).min() < 1e-6


@pytest.mark.parametrize(
    ("mode", "expected"),
    [
        (5, [(0, 1, 2), (1, 3, 2), (2, 3, 4)]),  # a strip: every second triangle is turned round
        (6, [(0, 1, 2), (0, 2, 3), (0, 3, 4)]),
    ],
)
def test_strips_and_fans(tmp_path: Path, mode: int, expected: list[tuple[int, int, int]]) -> None:
    points = np.float32([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0.2), (0, 2, 0.5)])
    content = document()
    content["meshes"] = [{"primitives": [{"attributes": {"POSITION": 0}, "mode": mode}]}]
    content["accessors"] = [{"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"}]
    content["bufferViews"] = [{"buffer": 0, "byteLength": 60}]
    uri = "data:;base64," + base64.b64encode(points.tobytes()).decode()
    content["buffers"] = [{"byteLength": 60, "uri": uri}]
    mesh = loaded(tmp_path, content).object("thing").mesh

    def turned(corners: np.ndarray) -> tuple[tuple[float, ...], ...]:
        """Corners in their order, the least first."""
        rows = [tuple(map(float, np.round(row, 5))) for row in corners]
        first = rows.index(min(rows))
        return tuple(rows[first:] + rows[:first])

    found = {turned(mesh.positions[face]) for face in mesh.faces}
    assert found == {turned(points[list(face)]) for face in expected}


def test_the_uv_set_that_a_texture_names(tmp_path: Path) -> None:
    png(tmp_path / "two.png", [[[255, 0, 0], [0, 0, 0]]])
    pbr = {"baseColorTexture": {"index": 0, "texCoord": 1}, "metallicFactor": 0}
    content = textured({"name": "m", "pbrMetallicRoughness": pbr}, ["two.png"])
    data = base64.b64decode(content["buffers"][0]["uri"].partition(",")[2])
    second = np.float32([(0.2, 0.3), (0.4, 0.5), (0.6, 0.8)])
    whole = data + b"\0\0" + second.tobytes()
    content["buffers"] = [{"byteLength": len(whole), "uri": "data:;base64," + base64.b64encode(whole).decode()}]
    content["bufferViews"].append({"buffer": 0, "byteOffset": len(data) + 2, "byteLength": 24})
    content["accessors"].append({"bufferView": 4, "componentType": 5126, "count": 3, "type": "VEC2"})
    content["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = 4
    mesh = loaded(tmp_path, content).object("thing").mesh
    order = [int(np.argmin(np.linalg.norm(mesh.positions - point, axis=1))) for point in TRIANGLE]
    np.testing.assert_allclose(mesh.uv[order], second * (1, -1) + (0, 1), atol=1e-6)


def test_a_coats_roughness_is_squared_as_the_bases(tmp_path: Path) -> None:
    coat = {"clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.4}
    look = {"name": "m", "pbrMetallicRoughness": {"roughnessFactor": 0.8, "metallicFactor": 1}}
    material = loaded(tmp_path, textured(look | {"extensions": {"KHR_materials_clearcoat": coat}}, [])).materials["m"]
    assert [lobe.mx for lobe in material.lobes] == pytest.approx([0.64, 0.16])
    assert material.lobes[1].r0 == pytest.approx((0.04,) * 3)
    bare = loaded(tmp_path, textured(look, [])).materials["m"]
    assert material.lobes[0].k == pytest.approx(0.96 * np.array(bare.lobes[0].k)), "the coat takes what it reflects"
