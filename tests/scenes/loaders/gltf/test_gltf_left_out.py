"""glTF: what is ignored or missing is said, and the rest of the scene is read."""

from __future__ import annotations

from pathlib import Path

from tests.scenes.loaders.gltf.test_gltf import document, loaded


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
    worn = {"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    content = document(materials=[worn], images=[{"uri": address}], textures=[{"source": 0}])
    content["meshes"][0]["primitives"][0]["material"] = 0
    scene = loaded(tmp_path, content)
    assert any(address in w and "only its factor is used" in w for w in scene.warnings)
