"""glTF's meshes as they are posed and placed: skins, morph targets, instances, and many nodes of one mesh."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.triangles import triangle_normals
from lambent.scenes.geometry import copies_under, sphere, transformed
from tests.scenes.loaders.gltf.test_gltf import TRIANGLE, document, loaded

FLOAT, BYTE = 5126, 5121


def with_arrays(content: dict[str, Any], *arrays: tuple[np.ndarray, int, str]) -> list[int]:
    """Numbers of new accessors, in buffers of their own."""
    first = len(content["accessors"])
    for array, component, kind in arrays:
        uri = "data:;base64," + base64.b64encode(array.tobytes()).decode()
        content["buffers"].append({"byteLength": array.nbytes, "uri": uri})
        content["bufferViews"].append({"buffer": len(content["buffers"]) - 1, "byteLength": array.nbytes})
        view = len(content["bufferViews"]) - 1
        content["accessors"].append({"bufferView": view, "componentType": component, "count": len(array), "type": kind})
    return list(range(first, len(content["accessors"])))


def skinned(**more: Any) -> dict[str, Any]:
    """The triangle, its first corner of one joint and the others half of a second, two metres up and turned."""
    half = np.sqrt(0.5)
    content = document(
        nodes=[
            {"mesh": 0, "skin": 0, "name": "thing", "translation": [50, 50, 50]},
            {"translation": [0, 0, 1]},
            {"translation": [0, 2, 0], "rotation": [0, half, 0, half]},
        ],
        scenes=[{"nodes": [0, 1, 2]}],
        **more,
    )
    joints = np.array([[0, 1, 0, 0]] * 3, np.uint8)
    weights = np.array([[1, 0, 0, 0], [0.5, 0.5, 0, 0], [0, 1, 0, 0]], np.float32)
    bound = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    bound[0, 3, 2] = -1  # by columns: the first joint was bound where it stands
    numbers = with_arrays(
        content, (joints, BYTE, "VEC4"), (weights, FLOAT, "VEC4"), (bound.reshape(2, 16), FLOAT, "MAT4")
    )
    content["meshes"][0]["primitives"][0]["attributes"] |= {"JOINTS_0": numbers[0], "WEIGHTS_0": numbers[1]}
    content["skins"] = [{"joints": [1, 2], "inverseBindMatrices": numbers[2]}]
    return content


@pytest.mark.parametrize("x", [1, -1])
def test_joints_place_a_skinned_mesh_and_its_node_does_not(tmp_path: Path, x: int) -> None:
    """Mirroring joints leave the triangle wound as its normals point."""
    content = skinned()
    for joint in (1, 2):
        content["nodes"][joint]["scale"] = [x, 1, 1]
    mesh = loaded(tmp_path, content).object("thing").mesh
    # (x, y, z) turned by 90 degrees about y is (z, y, -x)
    np.testing.assert_allclose(mesh.positions, [(0, 0, 0), (0.5 * x, 1, -0.5 * x), (0, 3, 0)], atol=1e-6)
    np.testing.assert_allclose(mesh.normals[[0, 2]], [(0, 0, 1), (1, 0, 0)], atol=1e-6)
    assert len(mesh.faces) == 1 and triangle_normals(mesh.corners)[0] @ mesh.normals.sum(axis=0) > 1


def test_a_skin_whose_joints_are_not_in_the_scene_is_told(tmp_path: Path) -> None:
    content = skinned()
    content["scenes"] = [{"nodes": [0, 1]}]
    scene = loaded(tmp_path, content)
    np.testing.assert_allclose(scene.object("thing").mesh.positions, TRIANGLE + 50, atol=1e-5)
    assert scene.warnings[0] == "thing: its skin is ignored, not all of its joints are in the scene"


def test_a_joint_beyond_the_skins_is_an_error_of_one_line(tmp_path: Path) -> None:
    content = skinned()
    content["skins"][0]["joints"] = [1]
    with pytest.raises(UserError, match=r"JOINTS_0: index out of range; found 1"):
        loaded(tmp_path, content)


@pytest.mark.parametrize(("weights", "height"), [(None, 2.0), ([0.25], 1.5), ([0.0], 1.0)])
def test_morph_targets_count_by_the_nodes_weights_or_the_meshs(
    tmp_path: Path, weights: list[float] | None, height: float
) -> None:
    node = {"mesh": 0, "name": "thing"} | ({} if weights is None else {"weights": weights})
    content = document(nodes=[node])
    raised = np.array([(0, 0, 0), (0, 0, 0), (0, 2, 0)], np.float32)
    (number,) = with_arrays(content, (raised, FLOAT, "VEC3"))
    content["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": number}]
    content["meshes"][0]["weights"] = [0.5]
    positions = loaded(tmp_path, content).object("thing").mesh.positions
    np.testing.assert_allclose(positions, [(0, 0, 0), (1, 0, 0), (0, height, 0)])


def test_instances_of_a_node_become_objects_but_for_those_without_size(tmp_path: Path) -> None:
    content = document(extensionsRequired=["EXT_mesh_gpu_instancing"], extensionsUsed=["EXT_mesh_gpu_instancing"])
    moves = np.array([(1, 0, 0), (5, 5, 5), (0, 0, 3)], np.float32)
    sizes = np.array([(1, 1, 1), (0, 0, 0), (2, 2, 2)], np.float32)
    move, size = with_arrays(content, (moves, FLOAT, "VEC3"), (sizes, FLOAT, "VEC3"))
    instances = {"attributes": {"TRANSLATION": move, "SCALE": size}}
    content["nodes"] = [
        {"mesh": 0, "name": "thing", "translation": [0, 1, 0], "extensions": {"EXT_mesh_gpu_instancing": instances}}
    ]
    scene = loaded(tmp_path, content)
    assert [o.name for o in scene.objects] == ["thing_1", "thing_3"]
    np.testing.assert_allclose(scene.objects[0].mesh.positions, TRIANGLE + np.array([1, 1, 0]))
    np.testing.assert_allclose(scene.objects[1].mesh.positions, 2 * TRIANGLE + np.array([0, 1, 3]))
    assert scene.warnings == ("thing_2: left out, its node's scale is zero",)


def test_instances_of_unlike_numbers_are_an_error(tmp_path: Path) -> None:
    content = document()
    two, three = np.zeros((2, 3), np.float32), np.ones((3, 3), np.float32)
    numbers = with_arrays(content, (two, FLOAT, "VEC3"), (three, FLOAT, "VEC3"))
    instances = {"attributes": dict(zip(("TRANSLATION", "SCALE"), numbers, strict=True))}
    content["nodes"] = [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": instances}}]
    with pytest.raises(UserError, match="instances have no number"):
        loaded(tmp_path, content)


def test_a_camera_that_is_too_wide_is_left_out(tmp_path: Path) -> None:
    cameras = [{"type": "perspective", "perspective": {"yfov": yfov, "znear": 0.1}} for yfov in (3.3, -0.5, 0.8)]
    nodes = [{"mesh": 0}, *({"camera": k, "name": name} for k, name in enumerate(("wide", "negative", "good")))]
    scene = loaded(tmp_path, document(nodes=nodes, scenes=[{"nodes": [0, 1, 2, 3]}], cameras=cameras))
    assert [camera.name for camera in scene.cameras] == ["good"]
    assert scene.warnings == (
        "wide: left out, a field of view of 189 degrees",
        "negative: left out, a field of view of -28.6 degrees",
    )


def matrices(count: int) -> np.ndarray:
    """Affine, every third one mirroring, and pairs that only move."""
    random = np.random.default_rng(1)
    found = np.tile(np.eye(4), (count, 1, 1))
    found[:, :3, :3] = random.normal(size=(count, 3, 3))
    found[1::2, :3, :3] = found[: count // 2 * 2 : 2, :3, :3]
    found[::3, :3, 0] *= -1
    found[:, :3, 3] = random.normal(size=(count, 3))
    return found


def test_copies_placed_at_once_are_the_copies_placed_one_by_one() -> None:
    mesh, worlds = sphere(1.0, 12, 6), matrices(7)
    for copy, world in zip(copies_under(mesh, worlds), worlds, strict=True):
        alone = transformed(mesh, world)
        for name in ("positions", "normals", "tangents", "uv", "faces"):
            assert np.array_equal(getattr(copy, name), getattr(alone, name)), name
        exact = mesh.positions.astype(float) @ world[:3, :3].T + world[:3, 3]
        np.testing.assert_allclose(copy.positions, exact, atol=1e-5)


def test_a_ground_of_any_size_is_no_matter_of_units(tmp_path: Path) -> None:
    """A plain of 50 km is as sane as the house on it; a house of 5 km is not."""
    nodes = [{"mesh": 0, "rotation": [0.5**0.5, 0, 0, 0.5**0.5], "scale": [5e4] * 3}, {"mesh": 0, "scale": [8] * 3}]
    content = document(nodes=nodes, scenes=[{"nodes": [0, 1]}])
    assert not [w for w in loaded(tmp_path, content).warnings if "unit" in w]
    nodes[1]["scale"] = [5e3] * 3
    assert [w for w in loaded(tmp_path, content).warnings if "is its unit the metre" in w]
