"""Files that are missing, or spelt otherwise than the scene spells them; scenes without light or camera."""

from __future__ import annotations

from pathlib import Path

import pytest

from lambent.core.errors import UserError
from lambent.scenes import load_scene
from lambent.scenes.loaders.contents import DAYLIGHT
from lambent.scenes.loaders.load import counted

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\nf 1/1/1 2/1/1 3/1/1\n"


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def mitsuba(folder: Path, *names: str) -> Path:
    shapes = "".join(f'<shape type="obj"><string name="filename" value="{name}"/></shape>' for name in names)
    return write(folder, "scene.xml", f'<scene version="3.0.0">{shapes}</scene>')


def test_a_mesh_that_is_missing_is_left_out_with_a_warning(tmp_path: Path) -> None:
    write(tmp_path, "models/here.obj", TRIANGLE)
    scene = load_scene(mitsuba(tmp_path, "models/here.obj", "models/gone.obj"))
    assert [o.name for o in scene.objects] == ["here"]
    assert "gone: left out, its file models/gone.obj is missing" in scene.warnings
    with pytest.raises(UserError, match=r"holds no triangles; .*gone\.obj is missing") as told:
        load_scene(mitsuba(tmp_path, "models/gone.obj"))
    assert "found" not in str(told.value)


def test_a_file_in_other_case_is_used_and_named(tmp_path: Path) -> None:
    write(tmp_path, "Models/Chair.OBJ", "mtllib WOOD.mtl\n" + TRIANGLE)
    write(tmp_path, "Models/wood.mtl", "newmtl a\nKd .1 .2 .3\n")
    scene = load_scene(mitsuba(tmp_path, "models/chair.obj"))
    assert len(scene.objects) == 1
    assert "models/chair.obj is spelt Models/Chair.OBJ on disk" in scene.warnings
    alone = load_scene(tmp_path / "Models/Chair.OBJ")
    assert (
        "WOOD.mtl is spelt Models/wood.mtl on disk" in alone.warnings
        or "WOOD.mtl is spelt wood.mtl on disk" in alone.warnings
    )
    toml = write(tmp_path, "scene.toml", _toml('"models/CHAIR.obj"'))
    assert "models/CHAIR.obj is spelt Models/Chair.OBJ on disk" in load_scene(toml).warnings


def test_two_files_that_differ_in_case_alone_are_not_confused(tmp_path: Path) -> None:
    for name in ("A.obj", "a.OBJ"):
        write(tmp_path, name, TRIANGLE)
    if len(list(tmp_path.iterdir())) < 2:
        pytest.skip("this disk does not tell case")
    scene = load_scene(mitsuba(tmp_path, "A.obj", "a.obj"))
    assert len(scene.objects) == 1 and "a: left out, its file a.obj is missing" in scene.warnings


def _toml(geometry: str, more: str = "") -> str:
    return f'format = "lambent-scene"\nversion = 1\nname = "s"\ngeometry = {geometry}\n{more}'


def test_a_scene_toml_without_light_or_camera_gets_what_its_geometry_alone_gets(tmp_path: Path) -> None:
    write(tmp_path, "a.obj", TRIANGLE)
    alone, scene = load_scene(tmp_path / "a.obj"), load_scene(write(tmp_path, "scene.toml", _toml('"a.obj"')))
    assert scene.environment == alone.environment == DAYLIGHT
    assert scene.cameras == alone.cameras and scene.exposure_ev is alone.exposure_ev is None  # metered
    assert "it has no light: daylight is added" in scene.warnings
    own = load_scene(
        write(tmp_path, "own.toml", _toml('"a.obj"', 'exposure_ev = 5.0\n[objects."*"]\nemission = [1, 1, 1]\n'))
    )
    assert own.environment is None and own.exposure_ev == 5.0 and len(own.cameras) == 1


def test_geometry_that_is_missing_is_left_out_where_some_is_there(tmp_path: Path) -> None:
    write(tmp_path, "a.obj", TRIANGLE)
    scene = load_scene(write(tmp_path, "scene.toml", _toml('["a.obj", "b.glb"]')))
    assert len(scene.objects) == 1 and "geometry b.glb is missing: left out" in scene.warnings
    with pytest.raises(UserError, match=r"no geometry file was found: b\.glb"):
        load_scene(write(tmp_path, "scene.toml", _toml('"b.glb"')))


def test_warnings_that_many_objects_share_are_one_with_a_count() -> None:
    many = [f"chair_{i}: no uv: box-mapped" for i in range(40)]
    told = counted(["the sun is low", *many[:3], "lamp: no normals", *many[3:], "leg: no normals"])
    assert told == [
        "the sun is low", "40 objects: no uv: box-mapped (chair_0, chair_1, ...)", "lamp: no normals", "leg: no normals"
    ]  # fmt: skip
