"""Files as other programs write them: encodings, corners with empty indices, vertex colours, axes, colours above 1."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import normalize
from lambent.scenes import load_scene
from lambent.scenes.loaders.contents import Contents
from lambent.scenes.loaders.scene_files import SceneFiles
from lambent.scenes.loaders.scene_toml.placing import placed
from lambent.scenes.photometry.files import parse_luminaire
from lambent.scenes.scene import DirectionalLight, IesLight, PointLight
from lambent.scenes.sky.environment_images import read_lat_long
from tests.scenes.loaders.gltf.test_gltf import document, loaded, textured
from tests.scenes.loaders.gltf.test_gltf_luminaires import UNEVEN, candela

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
