"""glTF: what is read comes out true; what is broken is one line or a stated repair."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from lambent.core.ceilings import TRIANGLES
from lambent.core.errors import UserError
from lambent.core.light.photometry import ILLUMINANCE, photometric
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Material
from lambent.scenes.geometry import signed_volume
from lambent.scenes.loaders.contents import DAYLIGHT
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.loaders.surfaces.material_builder import masking
from lambent.scenes.scene import DirectionalLight, PointLight, Scene
from lambent.scenes.validation import validate
from tests.scenes.loaders.pictures import png

TURNS = [0.2, 0.6, -0.3, 0.8], [0.5, -0.1, 0.7, 0.5]
TRIANGLE = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], np.float32)


def document(**more: Any) -> dict[str, Any]:
    """One triangle of one node; a test changes what it is about."""
    positions, normals = TRIANGLE.tobytes(), np.tile(np.float32([0, 0, 1]), (3, 1)).tobytes()
    uv, index = np.float32([(0, 1), (1, 1), (0, 0)]).tobytes(), np.uint16([0, 1, 2]).tobytes()
    data = positions + normals + uv + index
    views = [(0, 36), (36, 36), (72, 24), (96, 6)]
    kinds = [(5126, 3, "VEC3"), (5126, 3, "VEC3"), (5126, 3, "VEC2"), (5123, 3, "SCALAR")]
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "thing"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3}]}],
        "accessors": [
            {"bufferView": i, "componentType": c, "count": n, "type": t} for i, (c, n, t) in enumerate(kinds)
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": o, "byteLength": n} for o, n in views],
        "buffers": [{"byteLength": len(data), "uri": "data:;base64," + base64.b64encode(data).decode()}],
    } | more


def loaded(folder: Path, content: dict[str, Any]) -> Scene:
    path = folder / "thing.gltf"
    path.write_text(json.dumps(content))
    return load_scene(path)


def glb(content: dict[str, Any], binary: bytes) -> bytes:
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body


def test_a_bare_file_gets_daylight_and_a_camera_that_sees_it(tmp_path: Path) -> None:
    scene = loaded(tmp_path, document())
    assert scene.environment is not None and scene.warnings == () and validate(scene) == []
    mesh = scene.object("thing").mesh
    assert np.array_equal(mesh.positions, TRIANGLE) and np.allclose(mesh.tangents, (1, 0, 0))
    assert np.allclose(mesh.uv, [(0, 0), (1, 0), (0, 1)])  # v up
    camera = scene.cameras[0]
    view = np.subtract(camera.target, camera.position)
    for corner in TRIANGLE:
        way = corner - camera.position
        cosine = way @ view / np.linalg.norm(way) / np.linalg.norm(view)
        assert np.degrees(np.arccos(cosine)) < camera.fov_y_deg / 2


def test_a_sphere_of_another_writer(tmp_path: Path) -> None:
    """Written by trimesh, with transforms on its nodes, one of them mirroring."""
    made = trimesh.Scene()
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.5)
    made.add_geometry(ball, node_name="right", transform=trimesh.transformations.translation_matrix((2, 0, 0)))
    made.add_geometry(ball, node_name="mirrored", transform=np.diag([-1.0, 2.0, 1.0, 1.0]))
    made.export(tmp_path / "two.glb")
    scene = load_scene(tmp_path / "two.glb")
    right, mirrored = scene.object("right").mesh, scene.object("mirrored").mesh
    assert right.bounds[0][0] == pytest.approx(1.5, abs=1e-3) and right.bounds[1][0] == pytest.approx(2.5, abs=1e-3)
    assert signed_volume(mirrored) == pytest.approx(2 * float(ball.volume), rel=1e-4)
    assert len(right.faces) == len(ball.faces)
    assert validate(scene) == []


def test_materials(tmp_path: Path) -> None:
    content = document(
        nodes=[{"mesh": i, "name": str(i)} for i in range(5)],
        scenes=[{"nodes": [0, 1, 2, 3, 4]}],
        materials=[
            {"name": "gold", "pbrMetallicRoughness": {"baseColorFactor": [1, 0.8, 0.3, 1], "roughnessFactor": 0.5}},
            {"name": "plastic", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.2, 0.1, 1], "metallicFactor": 0}},
            {"name": "lamp", "emissiveFactor": [1, 0.5, 0.25],
             "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 8}}},
            {"name": "glass", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.3},
             "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.75}}},
            {"name": "brushed", "pbrMetallicRoughness": {"roughnessFactor": 0.2},
             "extensions": {"KHR_materials_anisotropy": {"anisotropyStrength": 0.5}}},
        ],
    )  # fmt: skip
    primitive = content["meshes"][0]["primitives"][0]
    content["meshes"] = [{"primitives": [primitive | {"material": i}]} for i in range(5)]
    scene = loaded(tmp_path, content)
    gold, plastic, glass, brushed = (scene.materials[n] for n in ("gold", "plastic", "glass", "brushed"))
    assert gold.kd == (0, 0, 0) and gold.lobes[0].r0 == pytest.approx((1, 0.8, 0.3))
    assert gold.lobes[0].mx == gold.lobes[0].my == pytest.approx(0.25) and gold.lobes[0].distribution == "ggx"
    assert plastic.kd == pytest.approx((0.48, 0.192, 0.096)) and plastic.lobes[0].r0 == pytest.approx((0.04,) * 3)
    assert scene.object("2").emission == (8, 4, 2)
    share = masking(0.09, 0.09, "ggx")[1]
    assert glass.transmission_lobes[0].k == pytest.approx((0.75 * share,) * 3) and glass.kd[0] == pytest.approx(0.24)
    assert brushed.lobes[0].my == pytest.approx(0.04) and brushed.lobes[0].mx == pytest.approx(0.04 + 0.96 * 0.25)
    theta = np.radians([0, 30, 60, 75])
    wo = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], axis=-1)
    for material in scene.materials.values():
        assert MaterialBSDF(material).albedo(wo).max() < 1.03, material.name


def test_lights_and_cameras(tmp_path: Path) -> None:
    """Spots and cameras look along their node's -z; the camera's up is its y. A cone has half angles."""
    half = np.sqrt(0.5)  # a quarter turn about x: -z becomes... -y is looked at with -90 degrees
    down = [-half, 0, 0, half]
    lights = [
        {"type": "directional", "intensity": 1000, "color": [1, 1, 1]},
        {"type": "spot", "intensity": 358, "color": [1, 0.5, 0.25],
         "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}},
    ]  # fmt: skip
    content = document(
        nodes=[
            {"mesh": 0, "name": "thing"},
            {"rotation": down, "extensions": {"KHR_lights_punctual": {"light": 0}}},
            {"rotation": TURNS[0], "translation": [0, 3, 0], "extensions": {"KHR_lights_punctual": {"light": 1}}},
            {"camera": 0, "rotation": TURNS[1], "translation": [0, 1, 5], "name": "view"},
        ],
        scenes=[{"nodes": [0, 1, 2, 3]}],
        cameras=[{"type": "perspective", "perspective": {"yfov": np.radians(40), "znear": 0.1}}],
        extensions={"KHR_lights_punctual": {"lights": lights}},
    )
    scene = loaded(tmp_path, content)
    sun, spot = scene.lights
    assert scene.environment == replace(DAYLIGHT, sun_direction=pytest.approx((0, 1, 0)), sun_scale=0), "one sun alone"
    assert isinstance(sun, DirectionalLight) and isinstance(spot, PointLight) and spot.direction is not None
    assert sun.direction == pytest.approx((0, -1, 0)) and photometric(
        np.array(sun.irradiance), ILLUMINANCE
    ) == pytest.approx(1000)
    assert spot.intensity == pytest.approx((2, 1, 0.5)) and spot.position == (0, 3, 0)
    turn, other = (Rotation.from_quat(turn).as_matrix() for turn in TURNS)
    assert spot.direction == pytest.approx(-turn[:, 2])
    assert (spot.inner_deg, spot.outer_deg) == pytest.approx((np.degrees(0.1), np.degrees(0.5)))
    assert [c.name for c in scene.cameras] == ["view"]
    (camera,) = scene.cameras
    assert camera.position == (0, 1, 5) and camera.fov_y_deg == pytest.approx(40)
    assert np.subtract(camera.target, camera.position) == pytest.approx(-other[:, 2]) and camera.up == pytest.approx(
        other[:, 1]
    )


def textured(material: dict[str, Any], images: list[str], **more: Any) -> dict[str, Any]:
    """A document whose triangle has `material`; texture i is picture i."""
    content = document(
        materials=[material], textures=[{"source": i} for i in range(len(images))],
        images=[{"uri": name} for name in images], **more,
    )  # fmt: skip
    content["meshes"][0]["primitives"][0]["material"] = 0
    return content


def test_a_texture_multiplies_the_mean_that_the_document_holds(tmp_path: Path) -> None:
    png(tmp_path / "half.png", [[[255, 0, 0]], [[0, 0, 0]]])
    look = {"baseColorTexture": {"index": 0}, "baseColorFactor": [0.5, 1, 1, 1], "metallicFactor": 0}
    content = textured({"name": "cloth", "pbrMetallicRoughness": look}, ["half.png"])
    scene = loaded(tmp_path, content)
    assert scene.materials["cloth"].kd == pytest.approx((0.24, 0, 0)) and not scene.materials["cloth"].kd_coupled
    texture = scene.textures["cloth"].diffuse
    assert texture is not None and texture.texels.dtype == np.float16
    assert np.allclose(texture.texels, [[[2, 1, 1]], [[0, 1, 1]]]) and scene.warnings == ()
    assert scene.textures["cloth"].specular is None and tmp_path / "half.png" in scene.sources
    content["images"][0]["uri"] = "../half.png"
    with pytest.raises(UserError, match="leaves its folder"):
        loaded(tmp_path, content)


def test_a_metals_picture_is_its_reflectance_and_never_more_than_arrives(tmp_path: Path) -> None:
    png(tmp_path / "base.png", [[[255, 255, 255], [255, 0, 0]]])
    png(tmp_path / "packed.png", [[[0, 255, 255], [0, 128, 0]]])  # metal and rough; dielectric and smoother
    look = {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1}}
    scene = loaded(tmp_path, textured({"name": "m", "pbrMetallicRoughness": look}, ["base.png", "packed.png"]))
    material, textures = scene.materials["m"], scene.textures["m"]
    assert textures.diffuse is not None and textures.specular is not None and textures.roughness is not None
    (lobe,) = material.lobes
    share = masking(0.252, 0.252, "ggx")[1]  # where it is smoothest
    head_on = np.array(lobe.k) * np.array(lobe.r0) * textures.specular.texels[0] / share
    assert head_on == pytest.approx(np.array([[1, 1, 1], [0.04, 0.04, 0.04]]), abs=2e-3)
    smooth = lobe.model_copy(update={"mx": 0.252, "my": 0.252, "r0": (1.0,) * 3})
    for theta_deg in (0, 40, 70, 82):
        wo = np.array([np.sin(np.radians(theta_deg)), 0, np.cos(np.radians(theta_deg))])
        assert MaterialBSDF(Material(lobes=(smooth,))).albedo(wo).max() <= 1.001
    diffuse = np.array(material.kd) * textures.diffuse.texels[0]
    assert diffuse == pytest.approx(np.array([[0, 0, 0], [0.96, 0, 0]]), abs=2e-3)
    assert lobe.mx * textures.roughness.texels[0, :, 0] == pytest.approx([1, (128 / 255) ** 2], abs=2e-3)
    assert any("normal incidence only" in w for w in scene.warnings)


def _texel_at(texture: Any, uv: tuple[float, float]) -> Any:
    """The texel a point's uv falls on, by the words of `scene.Texture`."""
    u, v = np.array(texture.uv_transform) @ (*uv, 1)
    height, width = texture.texels.shape[:2]
    return texture.texels[int((1 - v) % 1 * height), int(u % 1 * width)]


def test_texture_transforms(tmp_path: Path) -> None:
    """A quarter turn with half the scale shows the lower left quarter of the picture, as the extension's example."""
    png(tmp_path / "four.png", [[[10] * 3, [80] * 3], [[160] * 3, [250] * 3]])
    moved = {"offset": [0, 1], "rotation": np.pi / 2, "scale": [0.5, 0.5]}
    reference = {"index": 0, "extensions": {"KHR_texture_transform": moved}}
    look = {"name": "m", "normalTexture": {"index": 0}, "pbrMetallicRoughness": {"baseColorTexture": reference}}
    textures = loaded(tmp_path, textured(look, ["four.png"])).textures["m"]
    plain, turned = textures.normal, textures.specular
    corners = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)]
    assert plain is not None and turned is not None
    lower_left = _texel_at(plain, (0.25, 0.25))
    assert np.array_equal(lower_left, plain.texels[1, 0])
    assert all(np.array_equal(_texel_at(turned, c), turned.texels[1, 0]) for c in corners)


def test_holes_and_what_shines_through(tmp_path: Path) -> None:
    png(tmp_path / "leaf.png", [[[0, 255, 0, 255], [0, 255, 0, 0]]])
    pbr = {"baseColorTexture": {"index": 0}, "metallicFactor": 0}
    look = {"name": "m", "pbrMetallicRoughness": pbr, "alphaMode": "MASK", "alphaCutoff": 0.3}
    textures = loaded(tmp_path, textured(look, ["leaf.png"])).textures["m"]
    assert textures.opacity is not None and textures.cutoff == 0.3
    assert textures.opacity.texels.ravel().tolist() == [1, 0]
    scene = loaded(tmp_path, textured(look | {"alphaMode": "BLEND"}, ["leaf.png"]))
    assert scene.textures["m"].opacity is not None and "becomes a cut-out" in scene.warnings[0]
    pane = {"name": "m", "alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.25]}}
    scene = loaded(tmp_path, textured(pane, []))
    (through,) = scene.materials["m"].transmission_lobes
    assert through.k == (0.75,) * 3 and through.r0 == (0,) * 3 and "lets 75% of the light through" in scene.warnings[0]
    assert scene.materials["m"].reflection_lobes[0].k == pytest.approx((0.25 * masking(1, 1, "ggx")[1],) * 3)


def test_normal_maps_and_the_direction_of_anisotropy(tmp_path: Path) -> None:
    png(tmp_path / "normal.png", [[[128, 128, 255], [178, 102, 230]]])
    png(tmp_path / "way.png", [[[255, 128, 128], [128, 255, 128]]])
    brushed = {"anisotropyStrength": 0.8, "anisotropyRotation": np.pi / 2, "anisotropyTexture": {"index": 1}}
    look = {
        "name": "m", "normalTexture": {"index": 0, "scale": 0.5}, "pbrMetallicRoughness": {"roughnessFactor": 0.3},
        "extensions": {"KHR_materials_anisotropy": brushed},
    }  # fmt: skip
    scene = loaded(tmp_path, textured(look, ["normal.png", "way.png"]))
    textures = scene.textures["m"]
    assert textures.normal is not None and textures.direction is not None
    leaning = (np.array([178, 102, 230]) / 255 * 2 - 1) * (0.5, 0.5, 1)  # scaled across alone
    assert np.allclose(textures.normal.texels, [[(0, 0, 1), leaning / np.linalg.norm(leaning)]], atol=5e-3)
    assert np.allclose(textures.direction.texels, [[(0, 1), (-1, 0)]], atol=0.02)  # turned by a right angle
    assert validate(scene) == []
    mirrored = replace(scene.objects[0], mesh=replace(scene.objects[0].mesh, uv=scene.objects[0].mesh.uv * (-1, 1)))
    assert "mirrored on 100%" in validate(replace(scene, objects=(mirrored,)))[0]
    lobe = scene.materials["m"].lobes[0]
    assert lobe.my == pytest.approx(0.09) and lobe.mx == pytest.approx(0.09 + 0.91 * (0.8 * 128 / 255) ** 2, rel=1e-3)


def test_sparse_accessors(tmp_path: Path) -> None:
    """The third vertex is moved from (0, 1, 0) to (0, 2, 0), and normals begin as zeros."""
    content = document()
    data = base64.b64decode(content["buffers"][0]["uri"].partition(",")[2])
    put = np.uint16([2]).tobytes() + b"\0\0" + np.float32([0, 2, 0]).tobytes()
    ups = np.uint16([0, 1, 2]).tobytes() + b"\0\0" + np.tile(np.float32([0, 0, 1]), 3).tobytes()
    blocks, start = [], len(data) + -len(data) % 4
    whole = data + b"\0" * (-len(data) % 4) + put + ups
    for length in (2, 12, 6, 36):
        blocks.append({"buffer": 0, "byteOffset": start, "byteLength": length})
        start += length + -length % 4
    content["buffers"] = [{"byteLength": len(whole), "uri": "data:;base64," + base64.b64encode(whole).decode()}]
    content["bufferViews"] += blocks

    def sparse(count: int, first: int) -> dict[str, Any]:
        indices = {"bufferView": first, "componentType": 5123}
        return {"count": count, "indices": indices, "values": {"bufferView": first + 1}}

    content["accessors"][0]["sparse"] = sparse(1, 4)
    content["accessors"][1] = {"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse(3, 6)}
    mesh = loaded(tmp_path, content).object("thing").mesh
    assert np.array_equal(mesh.positions, [(0, 0, 0), (1, 0, 0), (0, 2, 0)]) and np.allclose(mesh.normals, (0, 0, 1))
    content["accessors"][1]["count"] = 10**12
    content["accessors"][1].pop("sparse")
    with pytest.raises(UserError, match="too many zeros"):
        loaded(tmp_path, content)


def test_what_is_missing_is_made_and_said(tmp_path: Path) -> None:
    content = document(nodes=[{"mesh": 0, "name": "a"}, {"mesh": 0, "name": "a"}], scenes=[{"nodes": [0, 1]}])
    content["meshes"][0]["primitives"][0]["attributes"] = {"POSITION": 0}
    scene = loaded(tmp_path, content)
    said = " ".join(scene.warnings)
    assert "flat" in said and "box-mapped" in said and "used twice" in said
    assert [o.name for o in scene.objects] == ["a", "a_2"]
    assert np.allclose(scene.object("a").mesh.normals, (0, 0, 1)) and validate(scene) == []


def _with_positions(points: Any, faces: Any) -> dict[str, Any]:
    points, faces = np.asarray(points, np.float32), np.asarray(faces, np.uint16)
    data = points.tobytes() + faces.tobytes()
    return document(
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        accessors=[
            {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": faces.size, "type": "SCALAR"},
        ],
        bufferViews=[
            {"buffer": 0, "byteLength": points.nbytes},
            {"buffer": 0, "byteOffset": points.nbytes, "byteLength": faces.nbytes},
        ],
        buffers=[{"byteLength": len(data), "uri": "data:;base64," + base64.b64encode(data).decode()}],
    )


def test_broken_triangles_go_and_that_is_said(tmp_path: Path) -> None:
    points = [*TRIANGLE.tolist(), (np.nan, 0, 0), (2, 0, 0)]
    scene = loaded(tmp_path, _with_positions(points, [(0, 1, 2), (0, 1, 3), (0, 1, 4)]))
    said = " ".join(scene.warnings)
    assert "1 triangles dropped: a vertex is not finite" in said and "1 triangles dropped: no area" in said
    assert len(scene.object("thing").mesh.faces) == 1 and validate(scene) == []


def _set(*path: Any) -> Callable[[dict[str, Any]], None]:
    """A change: all but the last of `path` lead to a place, the last is put there."""

    def change(content: dict[str, Any]) -> None:
        place: Any = content
        for step in path[:-2]:
            place = place[step]
        place[path[-2]] = path[-1]

    return change


BROKEN = {
    "index out of range": (_set("accessors", 0, "count", 2), "face index out of range|wrong length"),
    "huge count": (_set("accessors", 0, "count", 10**12), "accessor ends beyond its buffer view"),
    "huge buffer": (_set("buffers", 0, "byteLength", 10**13), "buffer is truncated"),
    "negative offset": (_set("bufferViews", 0, "byteOffset", -4), "greater than or equal to 0"),
    "no such mesh": (_set("nodes", 0, "mesh", 7), "index out of range"),
    "cycle": (_set("nodes", 0, "children", [0]), "several parents"),
    "wrong type": (_set("meshes", "none"), "list"),
    "wrong accessor type": (_set("accessors", 0, "type", "VEC2"), "wrong accessor type"),
    "old version": (_set("asset", "version", "1.0"), "unknown glTF version"),
    "compressed": (_set("extensionsRequired", ["KHR_draco_mesh_compression"]), "export without compression"),
    "network": (_set("buffers", 0, "uri", "https://example.org/a.bin"), "is on the network"),
    "path escape": (_set("buffers", 0, "uri", "../a.bin"), "leaves its folder"),
    "null in a name": (_set("buffers", 0, "uri", "a%00.bin"), "is not a file name"),
    "broken base64": (_set("buffers", 0, "uri", "data:;base64,%%%"), "base64"),
    "it has no light": (_set("nodes", 0, {"name": "empty"}), "holds no triangles"),
    "matrix that is not affine": (_set("nodes", 0, "matrix", [*[0.0] * 15, 0.0]), "not an affine matrix"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files_are_one_line(tmp_path: Path, name: str) -> None:
    change, said = BROKEN[name]
    content = document()
    change(content)
    with pytest.raises(UserError, match=said) as caught:
        loaded(tmp_path, content)
    assert "\n" not in str(caught.value) and str(tmp_path) in str(caught.value)


def test_a_scene_that_multiplies_itself_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lambent.scenes.loaders.gltf.nodes.TRIANGLES", replace(TRIANGLES, most=100))
    nodes = [{"mesh": 0} for _ in range(101)]
    with pytest.raises(UserError, match="scene is too large"):
        loaded(tmp_path, document(nodes=nodes, scenes=[{"nodes": list(range(101))}]))


def _good_glb() -> bytes:
    content = document()
    data = base64.b64decode(content["buffers"][0]["uri"].partition(",")[2])
    content["buffers"] = [{"byteLength": len(data)}]
    return glb(content, data + b"\0" * (-len(data) % 4))


def test_every_truncation_of_a_glb_is_one_line(tmp_path: Path) -> None:
    whole, path = _good_glb(), tmp_path / "cut.glb"
    path.write_bytes(whole)
    assert len(load_scene(path).objects) == 1
    for length in range(0, len(whole) - 4, 7):
        path.write_bytes(whole[:length])
        with pytest.raises(UserError):
            load_scene(path)


def test_variants_of_primitives_are_variants_of_the_scene(tmp_path: Path) -> None:
    names = [{"name": "oak"}, {"name": "night"}, {"name": "bare"}]
    lamp = {"name": "lamp", "emissiveFactor": [1, 1, 1]}
    content = textured({"name": "plain"}, [], extensions={"KHR_materials_variants": {"variants": names}})
    content["materials"] += [{"name": "wood", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.3, 0.1, 1]}}, lamp]
    mappings = [{"material": 1, "variants": [0]}, {"material": 2, "variants": [1]}]
    content["meshes"][0]["primitives"][0]["extensions"] = {"KHR_materials_variants": {"mappings": mappings}}
    scene = loaded(tmp_path, content)
    oak, night, bare = scene.variants
    assert oak.materials["plain"] == scene.materials["wood"] and not night.looks and not bare.looks
    assert "variant night: thing would change emission, which is ignored" in scene.warnings
    more = 'variant = "oak"\n[[variants]]\nname = "oak"\nlight.sun = "off"\n[[variants]]\nname = "red"\n'
    head = 'format = "lambent-scene"\nversion = 1\ngeometry = "thing.gltf"\n'
    (tmp_path / "scene.toml").write_text(f'{head}{more}materials.wood.colour = "#ff0000"\n')
    chosen = load_scene(tmp_path / "scene.toml")
    oak, night, bare, red = chosen.variants
    assert chosen.object("thing").material == "wood" and not oak.looks and not oak.light.of("sun").on
    assert bare.materials["wood"] == chosen.materials["plain"] and red.materials["wood"].kd[1] == 0


def test_extensions_that_are_not_read_are_said(tmp_path: Path) -> None:
    used = ["EXT_mesh_unheard_of", "KHR_materials_sheen", "KHR_mesh_quantization"]
    primitive = {**document()["meshes"][0]["primitives"][0], "material": 0}
    sheen = {"name": "cloth", "extensions": {"KHR_materials_sheen": {}}}
    scene = loaded(tmp_path, document(extensionsUsed=used, materials=[sheen], meshes=[{"primitives": [primitive]}]))
    assert [w for w in scene.warnings if "ignored" in w] == [
        "extension EXT_mesh_unheard_of is ignored", "material cloth: ignored: KHR_materials_sheen",
    ]  # fmt: skip


def test_a_compressed_primitive_without_its_numbers_is_said(tmp_path: Path) -> None:
    content = document(
        extensionsUsed=["KHR_draco_mesh_compression"], nodes=[{"mesh": 0}, {"mesh": 1, "name": "packed"}]
    )
    packed = {"attributes": {"POSITION": 4}, "extensions": {"KHR_draco_mesh_compression": {"bufferView": 0}}}
    content["accessors"].append({"componentType": 5126, "count": 3, "type": "VEC3"})
    content["meshes"].append({"primitives": [packed]})
    content["scenes"] = [{"nodes": [0, 1]}]
    scene = loaded(tmp_path, content)
    assert len(scene.objects) == 1
    said = "packed: left out, it is compressed (KHR_draco_mesh_compression): export without compression"
    assert said in scene.warnings


def test_a_picture_on_the_network_is_missing(tmp_path: Path) -> None:
    address = "https://pictures.example/wood.png"
    wood = {"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    scene = loaded(tmp_path, textured(wood, [address]))
    assert any(address in w and "only its factor is used" in w for w in scene.warnings)
