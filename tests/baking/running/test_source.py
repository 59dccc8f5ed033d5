"""A store knows its scene, and references are traced with the materials it was baked with."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.reference.path_traced import render_reference
from lambent.cli.main import run
from lambent.core.errors import UserError
from lambent.core.pictures.images import read_image
from lambent.materials.document import Material
from lambent.scenes.geometry import box
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import MaterialTextures, Scene, SceneObject, Texture
from lambent.store.source import changed_inputs, scene_of
from lambent.store.store import Store
from tests.baking.small_scenes import TINY, plane

RED = Material(kd=(0.9, 0.0, 0.0))
OBJ = """
v -1 0 1
v 1 0 1
v 1 0 -1
v -1 0 -1
f 1 2 3 4
"""


def changed(scene: Scene) -> Scene:
    """The scene with its first material replaced, as a Python user does it."""
    return replace(scene, materials={**scene.materials, scene.objects[0].material: RED})


@pytest.mark.long
def test_reference_has_the_materials_of_the_bake(tmp_path: Path) -> None:
    original = load_scene("builtin:box")
    scene = changed(original)
    bake(scene, tmp_path / "s", quality=TINY, only=["geometry"])
    store = Store.open(tmp_path / "s")
    assert store.documents["source"] == "builtin:box"
    found = scene_of(store)
    assert found.materials[scene.objects[0].material] == RED
    images = [render_reference(s, original.cameras[0], 24, 16, 16)[0] for s in (found, scene, original)]
    np.testing.assert_array_equal(images[0], images[1])
    assert images[0][..., 1].mean() < 0.9 * images[2][..., 1].mean(), "red reflects no green"


LAMP = """format = "lambent-scene"
version = 1
geometry = "floor.obj"
materials.grey.kd = {kd}
assign."*" = "grey"
environment = {{ kind = "constant", radiance = [{light}, {light}, {light}] }}
cameras = [{{ name = "front", position = [0, 3, 0.1], target = [0, 0, 0] }}]
"""


@pytest.mark.long
def test_a_scene_named_for_the_path_tracer_is_traced_with_its_own_materials(tmp_path: Path, capsys) -> None:
    (tmp_path / "floor.obj").write_text(OBJ)
    recorded, other = tmp_path / "scene.toml", tmp_path / "other.toml"
    recorded.write_text(LAMP.format(kd=0.2, light=1))
    bake(load_scene(str(recorded)), tmp_path / "s", quality=TINY, only=["geometry"])

    def mean(*options: str) -> tuple[float, str]:
        file = tmp_path / "a.exr"
        traced = ["--integrator", "path", "--size", "16x16", "--samples", "16", "--force", *options]
        assert run(["render", str(tmp_path / "s"), "-o", str(file), *traced]) == 0
        return float(read_image(file)[6:10, 6:10, :3].mean()), capsys.readouterr().err

    assert mean() == (pytest.approx(0.2, rel=0.02), "")
    other.write_text(LAMP.format(kd=0.6, light=2))
    assert mean("--scene", str(other))[0] == pytest.approx(1.2, rel=0.02)
    recorded.write_text(LAMP.format(kd=0.6, light=2))  # an edited file brings its light, not its materials
    found, said = mean()
    assert found == pytest.approx(0.4, rel=0.02)
    assert said.count("\n") == 1 and "scene.toml" in said and "materials of the bake" in said
    assert mean("--scene", str(recorded))[0] == pytest.approx(1.2, rel=0.02)
    assert run(["render", str(tmp_path / "s"), "-o", str(tmp_path / "b.exr"), "--scene", str(other)]) == 2
    assert "--integrator path" in capsys.readouterr().err


def test_textures_and_materials_of_objects_are_those_of_the_bake(tmp_path: Path) -> None:
    scene = load_scene("builtin:box")
    first, *others = scene.objects
    spots = MaterialTextures(diffuse=Texture(np.full((2, 2, 3), 0.5, np.float16)))
    objects = (replace(first, material="spotted", emission=(1.0, 2.0, 3.0)), *others)
    baked = replace(scene, objects=objects, materials={**scene.materials, "spotted": RED}, textures={"spotted": spots})
    found = scene_of(bake(baked, tmp_path / "s", quality=TINY, only=["geometry"]))
    assert (found.objects[0].material, found.objects[0].emission) == ("spotted", (1.0, 2.0, 3.0))
    assert found.textures.keys() == {"spotted"}
    np.testing.assert_array_equal(found.textures["spotted"].diffuse.texels, spots.diffuse.texels)


def test_files_are_found_from_the_store_wherever_one_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "scenes").mkdir()
    file = tmp_path / "scenes" / "floor.obj"
    file.write_text(OBJ)
    monkeypatch.chdir(tmp_path / "scenes")
    store = bake(load_scene("floor.obj"), tmp_path / "stores" / "s", quality=TINY, only=["geometry"])
    assert store.documents["source"] == "../../scenes/floor.obj"
    monkeypatch.chdir(tmp_path)
    assert scene_of(store).name == "floor" and changed_inputs(store, scene_of(store)) == []


def test_other_geometry_is_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    scene = load_scene("builtin:box")
    store = bake(scene, tmp_path / "s", quality=TINY, only=["geometry"])
    with caplog.at_level(logging.WARNING):
        scene_of(store)
    assert not caplog.records
    more = replace(scene, objects=(*scene.objects, SceneObject("more", box((1, 1, 1)), scene.objects[0].material)))
    store = bake(more, tmp_path / "s", quality=TINY, only=["geometry"])
    with caplog.at_level(logging.WARNING):
        scene_of(store)
    assert "geometry of its scene" in caplog.text and len(caplog.records) == 1


def test_an_object_whose_name_begins_like_a_part_of_another_is_none(tmp_path: Path, caplog) -> None:
    names, corners = ("hall", "hall.partition"), "\n".join(OBJ.strip().splitlines()[:4])
    faces = [f"o {name}\nusemtl {name}\nf {n} {n + 1} {n + 2} {n + 3}" for name, n in zip(names, (1, 5), strict=True)]
    file = tmp_path / "floor.obj"
    file.write_text("\n".join([corners, corners.replace(" 0 ", " 1 "), *faces]))
    with bake(load_scene(file), tmp_path / "s", quality=TINY, only=["geometry"]) as store, caplog.at_level(30):
        found = scene_of(store)
    assert [o.name for o in found.objects] == [*names] and "geometry of its scene" not in caplog.text


def test_a_scene_made_in_memory_has_to_be_named(tmp_path: Path) -> None:
    store = bake(plane(), tmp_path / "s", quality=TINY, only=["geometry"])
    with pytest.raises(UserError, match="--scene"):
        scene_of(store)
