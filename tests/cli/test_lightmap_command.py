"""The light map for other programs: the texel at a point's second coordinates is the light that arrives there."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

import lambent as api
from lambent.core.pictures.images import read_image
from lambent.scenes.loaders.gltf.container import read
from lambent.store.contract import scene_record

STORED = Path(__file__).parents[1] / "store" / "box-1.0.zip"


@pytest.fixture
def store(tmp_path):
    with zipfile.ZipFile(STORED) as packed:
        packed.extractall(tmp_path / "box.store")
    return tmp_path / "box.store"


def test_image_and_meshes_are_those_of_the_store(lambent, store, tmp_path):
    outcome = lambent("lightmap", store, "-o", tmp_path / "light.exr", "--json")
    assert outcome.code == 0 and outcome.json["written"] == [str(tmp_path / f"light.{end}") for end in ("exr", "glb")]
    arrays = api.open(store).arrays
    image = read_image(tmp_path / "light.exr")
    assert np.array_equal(image[..., :3], arrays.read("light_map/irradiance").astype(np.float32)) and image.max() > 0
    written = read(tmp_path / "light.glb", None)
    places, faces = arrays.read("geometry/positions"), arrays.read("geometry/faces")
    for o in scene_record(arrays).objects:
        mesh = written.document.meshes[next(n.mesh for n in written.document.nodes if n.name == o.name)]
        (part,) = mesh.primitives
        corners = written.accessor(part.indices).reshape(-1, 3)
        assert np.array_equal(corners, faces[o.first_face : o.first_face + o.face_count])
        u, v = arrays.read("geometry/uv").T
        columns = {"POSITION": places, "TEXCOORD_0": np.stack([u, 1 - v], axis=-1)}  # glTF has v down
        for name, array in {**columns, "TEXCOORD_1": arrays.read("geometry/uv2")}.items():
            found = written.floats(part.attributes[name], array.shape[1], name)
            assert found[corners] == pytest.approx(array[corners], abs=1e-6)


def test_files_stay_unless_forced_and_a_store_without_light_is_one_line(refused, lambent, store, tmp_path):
    mine = tmp_path / "light.glb"
    mine.write_bytes(b"mine")
    assert "light.glb" in refused("lightmap", store, "-o", tmp_path / "light.exr") and mine.read_bytes() == b"mine"
    assert ".exr" in refused("lightmap", store, "-o", tmp_path / "light.png")
    assert lambent("lightmap", store, "-o", tmp_path / "light.exr", "--force").code == 0
    with api.open(store).arrays as arrays:
        arrays.forget(["light_map/irradiance"])
    said = refused("lightmap", store, "-o", tmp_path / "other.exr")
    assert "has no light map" in said and "lambent bake" in said
    assert "not a store" in refused("lightmap", tmp_path, "-o", tmp_path / "other.exr")
