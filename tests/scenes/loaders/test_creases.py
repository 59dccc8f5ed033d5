"""Normals that lean far from their faces: told in one line, and made anew with hard edges."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from lambent.core.geometry.directions import normalize
from lambent.core.geometry.triangles import triangle_normals
from lambent.scenes import load_scene
from lambent.scenes.geometry import box, cylinder, sphere
from lambent.scenes.loaders.meshes.creases import creased, deviating_faces
from lambent.scenes.scene import Mesh
from tests.scenes.loaders.gltf.test_gltf import document
from tests.scenes.loaders.gltf.test_gltf_details import FLOAT, with_arrays

CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
SIDES = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 4, 8, 6)]  # the last turned


def shared_box(folder: Path, name: str = "box.obj") -> Path:
    """A box of eight vertices whose normals point out of its corners."""
    lines = ["o box"]
    lines += ["v " + " ".join(map(str, corner)) for corner in CORNERS]
    lines += ["vn " + " ".join(map(str, normal)) for normal in normalize(CORNERS - 0.5)]
    lines += ["f " + " ".join(f"{i}//{i}" for i in side) for side in SIDES]
    path = folder / name
    path.write_text("\n".join(lines))
    return path


def greatest_lean_deg(mesh: Mesh) -> float:
    faces = triangle_normals(mesh.corners.astype(float))
    cosine = np.abs((mesh.normals[mesh.faces] * faces[:, None]).sum(axis=2)).min()
    return float(np.degrees(np.arccos(min(1.0, cosine))))


def test_leaning_normals_are_told_once_and_a_crease_angle_mends_them(tmp_path: Path) -> None:
    path = shared_box(tmp_path)
    scene = load_scene(path)
    told = [warning for warning in scene.warnings if "crease" in warning]
    assert len(told) == 1 and told[0].startswith(
        "12 triangles of 1 objects (box) have normals over 40 degrees from the face"
    )
    assert greatest_lean_deg(scene.objects[0].mesh) == pytest.approx(54.7, abs=0.1)
    mended = load_scene(path, crease_deg=40.0)
    mesh = mended.objects[0].mesh
    assert mended.crease_deg == 40 and not any("crease" in warning for warning in mended.warnings)
    assert greatest_lean_deg(mesh) < 0.1 and len(mesh.positions) == 24 and len(mesh.faces) == 12
    assert ((mesh.normals * (mesh.positions - 0.5)).sum(axis=1) > 0).all(), "outwards, as the file has them"
    np.testing.assert_array_equal(mesh.corners, scene.objects[0].mesh.corners)
    assert np.abs((mesh.normals * mesh.tangents).sum(axis=1)).max() < 1e-5
    toml = tmp_path / "scene.toml"
    toml.write_text('format = "lambent-scene"\nversion = 1\ngeometry = "box.obj"\ncrease_angle = 40\n')
    np.testing.assert_array_equal(load_scene(toml).objects[0].mesh.normals, mesh.normals)


@pytest.mark.parametrize("ending", ["obj", "gltf"])
def test_missing_normals_are_flat_or_smooth_below_the_angle(tmp_path: Path, ending: str) -> None:
    """A hexagonal prism: its sides meet at 60 degrees, its caps at 90 with them; OBJ is smooth up to 40 by default."""
    prism = cylinder(1.0, 1.0, 6)
    corners = prism.corners.reshape(-1, 3)
    path = tmp_path / f"prism.{ending}"
    if ending == "obj":
        faces = [f"f {i} {i + 1} {i + 2}" for i in range(1, len(corners), 3)]
        path.write_text("\n".join(["o prism", *("v " + " ".join(map(str, p)) for p in corners.tolist()), *faces]))
    else:
        content = document(nodes=[{"mesh": 0, "name": "prism"}])
        (number,) = with_arrays(content, (corners.astype(np.float32), FLOAT, "VEC3"))
        content["meshes"][0]["primitives"] = [{"attributes": {"POSITION": number}}]
        path.write_text(json.dumps(content))
    (tmp_path / "scene.toml").write_text(
        f'format = "lambent-scene"\nversion = 1\ngeometry = "prism.{ending}"\ncrease_angle = 70\n'
    )
    for place, angle, lean_deg, told in (
        (path, None, 0.0, "faces are flat" if ending == "gltf" else "smooth where faces meet at less than 40 degrees"),
        (path, 50.0, 0.0, "smooth where faces meet at less than 50 degrees"),
        (path, 70.0, 30.0, "smooth where faces meet at less than 70 degrees"),
        (tmp_path / "scene.toml", None, 30.0, "smooth where faces meet at less than 70 degrees"),
    ):
        scene = load_scene(place, angle)
        (o,) = scene.objects
        assert f"prism: no normals: {told}" in scene.warnings
        assert greatest_lean_deg(o.mesh) == pytest.approx(lean_deg, abs=0.1)
        outwards = o.mesh.positions - (0, 0.5, 0)
        assert ((o.mesh.normals * outwards).sum(axis=1) > 0.1).all()
        np.testing.assert_allclose(o.mesh.corners, prism.corners, atol=1e-6)


def test_edges_below_the_angle_stay_smooth() -> None:
    ball = sphere(1.0, 24, 12)
    assert not deviating_faces([ball, box((1, 1, 1))]).any()
    smooth = creased(ball, 40.0)
    outwards = normalize(smooth.positions.astype(float))
    assert (smooth.normals * outwards).sum(axis=1).min() > np.cos(np.radians(8))
    assert greatest_lean_deg(creased(ball, 1.0)) < 0.1, "every edge of it is sharper than a degree"


def written(path: Path, meshes: dict[str, Mesh], *, split: bool, before: str = "") -> None:
    """An OBJ without normals; `split` gives every triangle vertices of its own. `before` comes before all faces."""
    lines, first = [before], 1
    for name, mesh in meshes.items():
        points = mesh.corners.reshape(-1, 3) if split else mesh.positions
        faces = np.arange(len(points)).reshape(-1, 3) if split else mesh.faces.astype(int)
        lines += ["v " + " ".join(f"{x:.6f}" for x in point) for point in points]
        lines += [f"o {name}", *("f " + " ".join(map(str, face)) for face in (faces + first).tolist())]
        first += len(points)
    path.write_text("\n".join(lines))


@pytest.mark.parametrize("split", [False, True])
def test_an_obj_without_normals_mirrors_as_a_ball_and_not_as_facets(tmp_path: Path, split: bool) -> None:
    """Facets of 15 degrees: normals are within a degree of the ball's, vertices are welded, a box keeps its edges."""
    ball = sphere(1.0, 24, 12)
    written(tmp_path / "s.obj", {"ball": ball, "box": box((1, 1, 1))}, split=split)
    scene = load_scene(tmp_path / "s.obj")
    smooth, hard = (scene.object(name).mesh for name in ("ball", "box"))
    assert (smooth.normals * normalize(smooth.positions.astype(float))).sum(axis=1).min() > np.cos(np.radians(1.0))
    assert len(smooth.positions) < 1.1 * len(ball.positions) and len(hard.positions) == 24
    assert greatest_lean_deg(hard) < 0.1
    assert "ball: no normals: smooth where faces meet at less than 40 degrees" in scene.warnings
    assert greatest_lean_deg(load_scene(tmp_path / "s.obj", 5.0).object("ball").mesh) < 1.0


@pytest.mark.parametrize(("said", "lean_deg"), [("s off", 0.0), ("s 0", 0.0), ("s 1", 10.0), ("", 10.0)])
def test_smoothing_groups_count_where_an_obj_has_them(tmp_path: Path, said: str, lean_deg: float) -> None:
    written(tmp_path / "s.obj", {"ball": sphere(1.0, 24, 12)}, split=False, before=said)
    mesh = load_scene(tmp_path / "s.obj").object("ball").mesh
    assert greatest_lean_deg(mesh) == pytest.approx(lean_deg, abs=2.0)


def test_thousands_of_faces_at_one_apex(tmp_path: Path) -> None:
    """Pairs of them would not fit into memory; the base of the cone stays hard, its side is smooth."""
    count = 40_000
    turn = 2 * np.pi * np.arange(count) / count
    rim = "\n".join(f"v {x:.8f} 0 {z:.8f}" for x, z in zip(np.cos(turn), np.sin(turn), strict=True))
    sides = "\n".join(f"f 1 {(i + 1) % count + 2} {i + 2}" for i in range(count))
    base = "f " + " ".join(str(i + 2) for i in range(count))
    (tmp_path / "cone.obj").write_text(f"v 0 1 0\n{rim}\no cone\n{sides}\n{base}\n")
    mesh = load_scene(tmp_path / "cone.obj").objects[0].mesh
    up = np.unique(mesh.normals[:, 1].round(3))
    assert up[0] == -1.0 and up[1:] == pytest.approx([np.sqrt(0.5)] * (len(up) - 1), abs=0.09)
