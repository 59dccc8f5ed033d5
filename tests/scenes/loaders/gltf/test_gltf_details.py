"""glTF in detail: transforms that nest, strips and fans, skins, instances; material extensions as lobes."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lambent.core.errors import UserError
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.sequences import cosine_hemisphere, hammersley
from lambent.core.geometry.triangles import triangle_normals
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Material
from lambent.scenes.geometry import copies_under, sphere, transformed
from lambent.scenes.loaders.surfaces.material_builder import masking
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


def test_specular_has_a_weight_and_a_colour(tmp_path: Path) -> None:
    """KHR_materials_specular: the weight holds at grazing incidence too; the base loses its highest channel."""
    plain = {"metallicFactor": 0, "roughnessFactor": 0.3}

    def seen(**said: Any) -> Material:
        look = {"name": "m", "pbrMetallicRoughness": plain, "extensions": {"KHR_materials_specular": said}}
        return loaded(tmp_path, textured(look, [])).materials["m"]

    grazing = np.array([np.sin(np.radians(85)), 0, np.cos(np.radians(85))])
    dull, half = seen(specularFactor=0), seen(specularFactor=0.5)
    assert MaterialBSDF(dull).albedo(grazing) == pytest.approx((1, 1, 1), abs=1e-6) and not dull.kd_coupled
    assert half.lobes[0].r0 == pytest.approx((0.04,) * 3)
    assert half.lobes[0].k == pytest.approx((0.5 * masking(0.09, 0.09, "ggx")[1],) * 3)
    tinted = seen(specularColorFactor=[5, 1, 1])
    assert tinted.lobes[0].r0 == pytest.approx((0.2, 0.04, 0.04)) and tinted.kd == pytest.approx((0.8,) * 3)


@pytest.mark.parametrize("roughness", [0.5, 0.7, 1.0])
def test_rough_surfaces_keep_their_colour_towards_grazing(tmp_path: Path, roughness: float) -> None:
    """glTF's diffuse term is the colour times 1 - F at the half vector, whose mean falls by 2 % up to 88 degrees."""

    def bsdf(colour: float) -> MaterialBSDF:
        look = {"metallicFactor": 0, "roughnessFactor": roughness, "baseColorFactor": [colour] * 3 + [1]}
        return MaterialBSDF(loaded(tmp_path, textured({"name": "m", "pbrMetallicRoughness": look}, [])).materials["m"])

    wi = cosine_hemisphere(hammersley(4096))
    for theta_deg in (0, 60, 80, 88):
        wo = np.array([np.sin(np.radians(theta_deg)), 0, np.cos(np.radians(theta_deg))])
        half = (wi + wo) / np.linalg.norm(wi + wo, axis=1, keepdims=True)
        theirs = 0.5 * np.mean(1 - (0.04 + 0.96 * (1 - half @ wo) ** 5))
        ours = bsdf(0.5).albedo(wo).max() - bsdf(0.0).albedo(wo).max()
        assert ours == pytest.approx(theirs, abs=0.015)
    wo = np.array([np.sin(np.radians(85)), 0, np.cos(np.radians(85))])
    assert bsdf(1.0).albedo(wo).max() <= 1.03, "white paint gives back no more than it gets"


def test_coats_take_from_what_is_below(tmp_path: Path) -> None:
    """A smooth mirror below a clear coat returns no more than arrives, up to 75 degrees; a tenth more up to 82."""
    coat = {"KHR_materials_clearcoat": {"clearcoatFactor": 1}}
    look = {"name": "m", "pbrMetallicRoughness": {"roughnessFactor": 0.1}, "extensions": coat}
    bsdf = MaterialBSDF(loaded(tmp_path, textured(look, [])).materials["m"])
    for theta_deg, most in ((0, 1.001), (45, 1.001), (75, 1.001), (82, 1.1)):
        wo = np.array([np.sin(np.radians(theta_deg)), 0, np.cos(np.radians(theta_deg))])
        assert 0.8 < bsdf.albedo(wo).max() <= most


def test_leaves_volumes_and_what_is_not_read(tmp_path: Path) -> None:
    leaf = {"diffuseTransmissionFactor": 0.25, "diffuseTransmissionColorFactor": [0.1, 0.8, 0.2]}
    more = {"KHR_materials_diffuse_transmission": leaf, "KHR_materials_sheen": {"sheenColorFactor": [1, 1, 1]}}
    look = {"name": "m", "pbrMetallicRoughness": {"metallicFactor": 0}, "extensions": more}
    scene = loaded(tmp_path, textured(look, []))
    material = scene.materials["m"]
    assert material.kd == pytest.approx((0.72,) * 3) and material.kt_d == pytest.approx((0.024, 0.192, 0.048))
    assert "material m: ignored: KHR_materials_sheen" in scene.warnings
    volume = {"thicknessFactor": 2, "attenuationDistance": 1, "attenuationColor": [0.5, 0.9, 1]}
    glass: dict[str, Any] = {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_volume": volume}
    look = {"name": "m", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0}, "extensions": glass}
    (through,) = loaded(tmp_path, textured(look, [])).materials["m"].transmission_lobes
    assert through.k == pytest.approx((0.25, 0.81, 1), rel=1e-3)
    png(tmp_path / "through.png", [[[255, 0, 255], [0, 0, 255]]])
    glass["KHR_materials_transmission"]["transmissionTexture"] = {"index": 0}
    (through,) = loaded(tmp_path, textured(look, ["through.png"])).materials["m"].transmission_lobes
    assert through.k == pytest.approx((0.125, 0.405, 0.5), rel=1e-3)


def test_specular_glossiness(tmp_path: Path) -> None:
    """The archived extension alone; where metallic-roughness is written beside it, that holds."""
    png(tmp_path / "gloss.png", [[[255, 255, 255, 255], [188, 188, 188, 128]]])
    older = {"diffuseFactor": [0.8, 0.4, 0.2, 1], "specularFactor": [0.5, 0.5, 0.5], "glossinessFactor": 0.8}
    look: dict[str, Any] = {"name": "m", "extensions": {"KHR_materials_pbrSpecularGlossiness": older}}
    material = loaded(tmp_path, textured(look, [])).materials["m"]
    assert material.kd == pytest.approx((0.4, 0.2, 0.1)) and material.lobes[0].mx == pytest.approx(0.04)
    assert material.lobes[0].r0 == pytest.approx((0.5,) * 3)
    both = look | {"pbrMetallicRoughness": {"metallicFactor": 0}}
    assert loaded(tmp_path, textured(both, [])).materials["m"].kd == pytest.approx((0.96,) * 3)
    older["specularGlossinessTexture"] = {"index": 0}
    scene = loaded(tmp_path, textured(look, ["gloss.png"]))
    roughness = scene.textures["m"].roughness
    assert roughness is not None and scene.textures["m"].specular is not None
    slopes = scene.materials["m"].lobes[0].mx * roughness.texels[0, :, 0]
    assert slopes == pytest.approx([0.04, (1 - 0.8 * 128 / 255) ** 2], rel=5e-3)
