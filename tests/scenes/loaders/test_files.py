"""Files as they are found: of new formats, of other programs, missing or spelt otherwise, without light or camera."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import normalize
from lambent.scenes import loaders
from lambent.scenes.loaders.contents import DAYLIGHT, Contents
from lambent.scenes.loaders.load import counted, formats, is_scene, load_scene
from lambent.scenes.loaders.scene_files import SceneFiles
from lambent.scenes.loaders.scene_toml.placing import placed
from lambent.scenes.photometry.files import parse_luminaire
from lambent.scenes.scene import DirectionalLight, IesLight, PointLight
from lambent.scenes.sky.environment_images import read_lat_long
from tests.scenes.loaders.gltf.test_gltf import document, loaded, textured
from tests.scenes.loaders.gltf.test_gltf_luminaires import UNEVEN, candela

TOY = '''
from lambent.scenes.geometry import box
from lambent.scenes.loaders.contents import Contents
from lambent.scenes.loaders.scene_files import SceneFiles
from lambent.materials.document import Material
from lambent.scenes.scene import SceneObject

NAME, ENDINGS = "Toy", (".toy",)


def recognise(head):
    return head.startswith(b"toy")


def load(path, options):
    """A cube of the size that the file names."""
    files = SceneFiles(path, options.root)
    size = float(files.read(path, 100).split()[1])
    return Contents((SceneObject("cube", box((size,) * 3), "wood"),), {"wood": Material(name="wood", kd=(0.5,) * 3)},
                    sources=tuple(files.sources))
'''


@pytest.fixture
def toy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file of a format that a folder beside the loaders adds."""
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "toy_format.py").write_text(TOY)
    monkeypatch.setattr(loaders, "__path__", [*loaders.__path__, str(tmp_path / "more")])
    path = tmp_path / "cube.toy"
    path.write_text("toy 3")
    return path


def test_a_new_format_is_one_file(toy: Path) -> None:
    assert "Toy" in {module.NAME for module in formats()}
    scene = load_scene(toy)
    assert np.array_equal(scene.bounds, [(-1.5,) * 3, (1.5,) * 3]) and scene.sources == (toy,)
    assert scene.environment is not None and len(scene.cameras) == 1
    assert is_scene(toy, b"toy 3") and not is_scene(toy, b"boy 3")
    (toy.parent / "scene.toml").write_text(
        'format = "lambent-scene"\nversion = 1\ngeometry = { file = "cube.toy", scale = 2.0 }\n'
    )
    assert load_scene(toy.parent / "scene.toml").object("cube").mesh.bounds[1].tolist() == [3.0, 3.0, 3.0]


def test_what_no_loader_reads_is_told_with_every_ending(tmp_path: Path) -> None:
    (tmp_path / "a.fbx").touch()
    with pytest.raises(UserError, match=r"unknown scene format; found .fbx; expected .bpt, .*.gltf, .*.ply, .toml"):
        load_scene(tmp_path / "a.fbx")
    with pytest.raises(UserError, match=r"unknown scene format; found a folder; expected .bpt"):
        load_scene(tmp_path)
    with pytest.raises(
        UserError, match=r"found rom; expected box, cornell, .*, room, teatray, vase; did you mean 'room'"
    ):
        load_scene("builtin:rom")


FACE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\nf 1/1/1 2/1/1 3/1/1\n"


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def mitsuba(folder: Path, *names: str) -> Path:
    shapes = "".join(f'<shape type="obj"><string name="filename" value="{name}"/></shape>' for name in names)
    return write(folder, "scene.xml", f'<scene version="3.0.0">{shapes}</scene>')


def test_a_mesh_that_is_missing_is_left_out_with_a_warning(tmp_path: Path) -> None:
    write(tmp_path, "models/here.obj", FACE)
    scene = load_scene(mitsuba(tmp_path, "models/here.obj", "models/gone.obj"))
    assert [o.name for o in scene.objects] == ["here"]
    assert "gone: left out, its file models/gone.obj is missing" in scene.warnings
    with pytest.raises(UserError, match=r"holds no triangles; .*gone\.obj is missing") as told:
        load_scene(mitsuba(tmp_path, "models/gone.obj"))
    assert "found" not in str(told.value)


def test_a_file_in_other_case_is_used_and_named(tmp_path: Path) -> None:
    write(tmp_path, "Models/Chair.OBJ", "mtllib WOOD.mtl\n" + FACE)
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
        write(tmp_path, name, FACE)
    if len(list(tmp_path.iterdir())) < 2:
        pytest.skip("this disk does not tell case")
    scene = load_scene(mitsuba(tmp_path, "A.obj", "a.obj"))
    assert len(scene.objects) == 1 and "a: left out, its file a.obj is missing" in scene.warnings


def _toml(geometry: str, more: str = "") -> str:
    return f'format = "lambent-scene"\nversion = 1\nname = "s"\ngeometry = {geometry}\n{more}'


def test_a_scene_toml_without_light_or_camera_gets_what_its_geometry_alone_gets(tmp_path: Path) -> None:
    write(tmp_path, "a.obj", FACE)
    alone, scene = load_scene(tmp_path / "a.obj"), load_scene(write(tmp_path, "scene.toml", _toml('"a.obj"')))
    assert scene.environment == alone.environment == DAYLIGHT
    assert scene.cameras == alone.cameras and scene.exposure_ev is alone.exposure_ev is None  # metered
    assert "it has no light: daylight is added" in scene.warnings
    own = load_scene(
        write(tmp_path, "own.toml", _toml('"a.obj"', 'exposure_ev = 5.0\n[objects."*"]\nemission = [1, 1, 1]\n'))
    )
    assert own.environment is None and own.exposure_ev == 5.0 and len(own.cameras) == 1


def test_geometry_that_is_missing_is_left_out_where_some_is_there(tmp_path: Path) -> None:
    write(tmp_path, "a.obj", FACE)
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
    assert counted([f"material {i}: clipped to 1" for i in range(3)]) == [
        "3 materials: clipped to 1 (material 0, material 1, ...)"
    ]


TRIANGLE = "v 0 0 0\nv 1 0 0\nv 1 1 0\n"
PICTURE = np.linspace(0.1, 1, 16 * 32 * 3, dtype=np.float32).reshape(16, 32, 3)


def exr(path: Path, *parts: dict[str, np.ndarray]) -> Path:
    kind = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    made = [OpenEXR.Part(dict(kind), channels, f"part{i}") for i, channels in enumerate(parts)]
    OpenEXR.File(made).write(str(path))
    return path


def test_names_in_latin_1_find_their_materials(tmp_path: Path) -> None:
    text = "mtllib möbel.mtl\no Stühle\n" + TRIANGLE + "usemtl Grün\nf 1 2 3\n"
    (tmp_path / "a.obj").write_bytes(text.encode("latin-1"))
    (tmp_path / "möbel.mtl").write_bytes("newmtl Grün\nKd 0 0.5 0\n".encode("latin-1"))
    scene = load_scene(tmp_path / "a.obj")
    assert scene.objects[0].name == "Stühle" and scene.materials["Grün"].kd == (0, 0.5, 0)


@pytest.mark.parametrize("corners", ["1// 2// 3//", "1/ 2/ 3/", "1/1/ 2/1/ 3/1/"])
def test_corners_may_end_in_slashes(tmp_path: Path, corners: str) -> None:
    (tmp_path / "a.obj").write_text(f"{TRIANGLE}vt 0 0\nf {corners}\n")
    assert len(load_scene(tmp_path / "a.obj").objects[0].mesh.faces) == 1


def test_vertex_colours_are_said_to_be_ignored(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 1 1 0 1 0 0\nf 1 2 3\n")
    head = "ply\nformat ascii 1.0\nelement vertex 3\n" + "".join(f"property float {c}\n" for c in ("x", "y", "z"))
    head += "".join(f"property uchar {c}\n" for c in ("red", "green", "blue"))
    rows = "0 0 0 255 0 0\n1 0 0 255 0 0\n1 1 0 255 0 0\n3 0 1 2\n"
    face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "a.ply").write_text(head + face + rows)
    (tmp_path / "plain.obj").write_text(TRIANGLE + "f 1 2 3\n")
    for name, coloured in (("a.obj", True), ("a.ply", True), ("plain.obj", False)):
        assert ("vertex colours are ignored" in load_scene(tmp_path / name).warnings) == coloured, name


def test_base_colours_above_1_are_clipped(tmp_path: Path) -> None:
    look = {"name": "m", "pbrMetallicRoughness": {"metallicFactor": 1, "baseColorFactor": [1.5, 0.5, 0.2, 1]}}
    scene = loaded(tmp_path, textured(look, []))
    assert scene.materials["m"].lobes[0].r0 == pytest.approx((1, 0.5, 0.2), abs=1e-3)
    assert any("clipped to 1" in warning for warning in scene.warnings)


def test_geometry_with_z_up_stands_upright(tmp_path: Path) -> None:
    """A post along the file's +z, 3 units of .1 m high; the file's +x stays +x."""
    (tmp_path / "post.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 0 3\nf 1 2 3\n")
    head = 'format = "lambent-scene"\nversion = 1\ngeometry = { file = "post.obj", scale = 0.1, up = "+z" }\n'
    (tmp_path / "scene.toml").write_text(head)
    low, high = load_scene(tmp_path / "scene.toml").bounds
    assert low == pytest.approx((0, 0, 0), abs=1e-6) and high == pytest.approx((0.1, 0.3, 0), abs=1e-6)


@pytest.mark.parametrize("up", ["+y", "+z", "-x"])
def test_lights_are_placed_with_their_geometry(tmp_path: Path, up: str) -> None:
    """Intensities towards directions of the file are those towards the same directions of the scene."""
    scene = loaded(tmp_path, document())
    lamp = parse_luminaire(UNEVEN.encode(), tmp_path, SceneFiles(tmp_path))
    lights = (
        PointLight((1, 2, 3), (1, 1, 1), direction=(0, 0, -1)),
        DirectionalLight((0, 0, -1), (1, 1, 1)),
        IesLight((1, 2, 3), lamp.photometry(), (1, 1, 1), (0, 0, -1), 30.0),
    )
    contents = Contents(scene.objects, scene.materials, lights=lights)
    spot, sun, luminaire = placed(contents, 0.5, up, tmp_path).lights  # type: ignore[arg-type]
    axis = {"+y": (0, 1, 0), "+z": (0, 0, 1), "-x": (-1, 0, 0)}[up]
    assert isinstance(spot, PointLight) and isinstance(sun, DirectionalLight) and isinstance(luminaire, IesLight)
    for light in (spot, luminaire):
        assert light.position[1] == pytest.approx(0.5 * np.dot(axis, (1, 2, 3)))
    turned = placed(
        Contents(scene.objects, lights=tuple(DirectionalLight(w, (1, 1, 1)) for w in np.eye(3))), 0.5, up, tmp_path
    )  # type: ignore[arg-type]
    matrix = np.stack([light.direction for light in turned.lights], axis=1)  # type: ignore[union-attr]
    assert matrix @ axis == pytest.approx((0, 1, 0)) and np.linalg.det(matrix) == pytest.approx(1)
    assert sun.direction == pytest.approx(matrix @ (0, 0, -1)) and spot.direction == pytest.approx(sun.direction)
    before = lights[2]
    for w in normalize(np.array([(0, 0, -1), (1, 0, -1), (0, 1, -1), (-1, 0.5, -2)])):
        assert candela(luminaire, tuple(matrix @ w)) == pytest.approx(candela(before, tuple(w)), abs=1e-3)


def test_an_exr_in_parts_is_its_first_part_with_colour(tmp_path: Path) -> None:
    depth, colour = {"Z": PICTURE[..., 0].copy()}, {"RGB": PICTURE}
    for parts in ((colour, depth), (depth, colour)):
        np.testing.assert_array_equal(read_lat_long(exr(tmp_path / "a.exr", *parts)), PICTURE)
    with pytest.raises(UserError, match="no picture channels"):
        read_lat_long(exr(tmp_path / "b.exr", depth, depth))


def test_single_pixels_that_are_not_finite_do_not_spoil_surroundings(tmp_path: Path) -> None:
    """A sun beyond half floats is infinite in the file; elsewhere the picture is as written."""
    half = PICTURE.astype(np.float16)
    spoilt = half.copy()
    spoilt[3, 5], spoilt[8, 9] = np.inf, np.nan
    read = read_lat_long(exr(tmp_path / "a.exr", {"RGB": spoilt}))
    assert (read[3, 5] == 65504).all() and (read[8, 9] == 0).all()
    elsewhere = np.isfinite(spoilt)
    np.testing.assert_array_equal(read[elsewhere], half[elsewhere].astype(np.float32))
    spoilt[:2] = np.nan
    with pytest.raises(UserError, match="not finite"):
        read_lat_long(exr(tmp_path / "a.exr", {"RGB": spoilt}))


@pytest.mark.parametrize("shape", [(1, 1), (1, 8), (8, 1), (2, 4)])
def test_surroundings_of_few_pixels_have_enough_for_the_path_tracer(tmp_path: Path, shape: tuple[int, int]) -> None:
    """Each pixel is repeated, so the light of a row or column stays."""
    picture = PICTURE[: shape[0], : shape[1]].copy()
    read = read_lat_long(exr(tmp_path / "a.exr", {"RGB": picture}))
    assert min(read.shape[:2]) >= 4 and read.mean(axis=(0, 1)) == pytest.approx(picture.mean(axis=(0, 1)), rel=1e-5)
