"""Meshes of files: normals that lean are told and made anew with hard edges; flush surfaces are raised."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.triangles import triangle_normals
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import box, cylinder, merge, placed, signed_volume, sphere, turn
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.loaders.meshes.flush import RAISED, with_flush_raised
from lambent.scenes.loaders.meshes.repair import creased, deviating_faces
from lambent.scenes.scene import Mesh, Scene, SceneObject
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


@pytest.mark.long
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


LOOKS = {name: Material(name=name, kd=(0.5, 0.4, 0.3)) for name in ("plaster", "paper", "ink", "oak", "ash", "tile")}
LOOKS["steel"] = Material(name="steel", lobes=(Lobe(mx=0.1, my=0.1),))
DOWN, SOUTH, NORTH = turn("x", 180), turn("x", 90), turn("x", -90)  # what looked up looks along -y, z, -z
UP = (0.0, 1.0, 0.0)
Things = dict[str, tuple[str, Mesh]]


def sheet(width: float, depth: float, at: ArrayLike = (0, 0, 0), rotation: Floats | None = None) -> Mesh:
    """A rectangle in y = 0 that looks up, rotated, then moved."""
    x, z = width / 2, depth / 2
    corners = np.array([(-x, 0, -z), (-x, 0, z), (x, 0, z), (x, 0, -z)], np.float32)
    up, along = np.tile(np.array(UP, np.float32), (4, 1)), np.tile(np.array([1, 0, 0], np.float32), (4, 1))
    return placed(
        Mesh(corners, up, along, corners[:, [0, 2]], np.array([(0, 1, 2), (0, 2, 3)], np.uint32)), at, rotation
    )


def scene_of(things: Things) -> Scene:
    return Scene("flush", tuple(SceneObject(name, mesh, look) for name, (look, mesh) in things.items()), LOOKS)


def layers(things: Things) -> dict[str, list[float]]:
    """Mean moves (3,) of the objects that moved, in layers."""
    before = scene_of(things)
    after, found = with_flush_raised(before), {}
    for was, now in zip(before.objects, after.objects, strict=True):
        if now is not was:
            own = RAISED * (1 + np.abs(was.mesh.positions).max())
            moves = (now.mesh.positions.astype(float) - was.mesh.positions) / own
            found[was.name] = (moves.mean(axis=0).round(1) + 0.0).tolist()
            assert np.abs(moves - moves.mean(axis=0)).max() < 0.3, "moved evenly"
    assert [int(w.split()[0]) for w in after.warnings] == [len(found)] * bool(found)
    return found


FLOOR = ("plaster", sheet(4, 4))
RUG = ("oak", sheet(1, 2, (0.3, 0, 0.2)))
TILES: Things = {
    f"tile_{i}_{k}": ("tile", sheet(0.5, 0.5, (i / 2, 0, k / 2))) for i in range(-3, 4) for k in range(-3, 4)
}
CASES: dict[str, tuple[Things, dict[str, tuple[float, float, float]]]] = {
    "a rug on a floor": ({"rug": RUG, "floor": FLOOR}, {"rug": (0, 1, 0)}),
    "a rug on tiles that are smaller": (TILES | {"rug": RUG}, {"rug": (0, 1, 0)}),
    "so it is before them in the file": ({"rug": RUG} | TILES, {"rug": (0, 1, 0)}),
    "three layers, by size, two of them on the floor": (
        {"note": ("ink", sheet(0.2, 0.2)), "floor": FLOOR, "rug": RUG},
        {"note": (0, 2, 0), "rug": (0, 1, 0)},
    ),
    "of equal ones the later": ({"a": ("oak", sheet(1, 1)), "b": ("ash", sheet(1, 1))}, {"b": (0, 1, 0)}),
    "of equal ones with other corners too": (
        {"a": ("oak", sheet(1, 1)), "b": ("ash", sheet(1, 1, rotation=turn("y", 90)))},
        {"b": (0, 1, 0)},
    ),
    "a wall doubled for the next room": (
        {"here": ("plaster", sheet(4, 3, rotation=SOUTH)), "there": ("oak", sheet(2, 3, rotation=NORTH))},
        {"there": (0, 0, -1)},
    ),
    "a label that looks into its box": (
        {"box": ("oak", box((1, 1, 1))), "label": ("ink", sheet(0.5, 0.5, (0, 0.5, 0), DOWN))},
        {"label": (0, 1, 0)},
    ),
    "a rug with its back": (
        {"floor": FLOOR, "rug": ("oak", merge([sheet(1, 1, rotation=DOWN), sheet(1, 1)]))},
        {"rug": (0, 1, 0)},
    ),
    "a box on the floor": ({"floor": FLOOR, "box": ("oak", placed(box((1, 1, 1)), (0, 0.5, 0)))}, {}),
    "boxes side by side": ({"a": ("oak", box((1, 1, 1))), "b": ("ash", placed(box((1, 1, 1)), (1, 0, 0)))}, {}),
    "a wall on a floor": ({"floor": FLOOR, "wall": ("oak", sheet(4, 3, (0, 1.5, -2), SOUTH))}, {}),
    "a rug that lies a millimetre above": ({"floor": FLOOR, "rug": ("oak", sheet(1, 1, (0, 1e-3, 0)))}, {}),
    "surfaces that look the same": ({"floor": FLOOR, "more": ("plaster", sheet(1, 1))}, {}),
    "copies of a thing": ({"a": ("steel", sheet(1, 1)), "b": ("steel", sheet(1, 1))}, {}),
    "surfaces that reflect": ({"a": ("steel", sheet(2, 2)), "b": ("steel", sheet(1, 1))}, {"b": (0, 1, 0)}),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_which_surfaces_move(name: str) -> None:
    things, expected = CASES[name]
    assert layers(things) == {key: [float(x) for x in by] for key, by in expected.items()}


def test_marquetry_and_a_warning_that_names_it() -> None:
    table = placed(box((1, 0.04, 1)), (0, 0.7, 0))
    pieces: Things = {
        f"piece_{n}": (("ash", "paper")[n % 2], sheet(0.1, 0.05, ((n % 5 - 2) * 0.1, 0.72, (n // 5 - 4.5) * 0.05)))
        for n in range(50)
    }
    things = pieces | {"table": ("oak", table)}
    assert layers(things) == {name: [0.0, 1.0, 0.0] for name in pieces}
    (told,) = with_flush_raised(scene_of(things)).warnings
    assert told.startswith(
        "50 flush surfaces (piece_0 on table, piece_1 on table, piece_2 on table and 47 more): of two "
    )
    assert told.endswith("in one plane the smaller, or else the later, is raised by at most 0.086 mm")


def test_a_sticker_around_a_corner_stays_whole_and_a_body_closed() -> None:
    """Both sides of a sticker move, their common edge by both; the top of a body moves with the edges of its sides."""
    top, side = sheet(0.1, 0.1, (0.45, 0.5, 0)), sheet(0.1, 0.1, (0.5, 0.45, 0), turn("z", -90))
    body = box((1, 1, 1))
    scene = scene_of({"body": ("oak", body), "sticker": ("ink", merge([top, side]))})
    sticker = with_flush_raised(scene).object("sticker").mesh
    by = (sticker.positions.astype(float) - scene.object("sticker").mesh.positions) / (1.5 * RAISED)
    edge = np.isclose(scene.object("sticker").mesh.positions[:, :2], 0.5).all(axis=1)
    np.testing.assert_allclose(by[edge], [[1, 1, 0]] * 4, atol=0.02)
    np.testing.assert_allclose(by[~edge].sum(axis=1), 1, atol=0.02)
    rug = placed(box((1, 0.02, 1)), (0, -0.01, 0))
    let_in = with_flush_raised(scene_of({"floor": FLOOR, "rug": ("oak", rug)})).object("rug").mesh
    raised = np.unique(let_in.positions[:, 1])
    np.testing.assert_allclose(raised, [-0.02, 1.5 * RAISED], atol=2e-6)
    assert signed_volume(let_in) == pytest.approx(0.02 + 1.5 * RAISED, rel=1e-3)


def test_doubled_curved_surfaces_move_without_spikes() -> None:
    """A shade with a lining of the same triangles: the later one lies around the earlier."""
    from lambent.scenes.geometry import sphere

    scene = scene_of({"shade": ("paper", sphere(0.2, 48, 24)), "lining": ("ink", sphere(0.2, 48, 24))})
    after = with_flush_raised(scene)
    assert after.object("shade") is scene.object("shade")
    radius = np.linalg.norm(after.object("lining").mesh.positions.astype(float), axis=1)
    assert radius.min() > 0.2 + 0.9 * RAISED and radius.max() < 0.2 + 1.6 * RAISED


def test_a_ground_of_kilometres() -> None:
    things: Things = {"ground": ("plaster", sheet(5e4, 5e4)), "lawn": ("ash", sheet(3, 3, (2, 0, 1)))}
    lawn = with_flush_raised(scene_of(things)).object("lawn").mesh
    assert lawn.positions[:, 1].min() > 0.005 and lawn.positions[:, 1].max() < 0.03, "above what rays are offset there"


def test_far_from_the_origin_by_more_than_positions_are_rounded() -> None:
    at = np.array([3000.0, 40.0, -7000.0])
    things: Things = {"wall": ("plaster", sheet(4, 3, at, SOUTH)), "poster": ("ink", sheet(1, 1, at, SOUTH))}
    moves = (
        with_flush_raised(scene_of(things)).object("poster").mesh.positions[:, 2] - things["poster"][1].positions[:, 2]
    )
    assert (moves > 100 * np.spacing(np.float32(7000))).all()


def test_every_loader_raises_and_an_emitter_counts_as_another_look(tmp_path: Path) -> None:
    """A lamp of the ceiling's material, flush with it; with textures, emission and lobes alike, nothing would show."""
    lines = ["o ceiling", "v -2 3 -2", "v 2 3 -2", "v 2 3 2", "v -2 3 2", "f 1 2 3 4"]
    lines += ["o lamp", "v -1 3 -1", "v 1 3 -1", "v 1 3 1", "v -1 3 1", "f 5 6 7 8"]
    (tmp_path / "room.obj").write_text("\n".join(lines))
    toml = tmp_path / "scene.toml"
    toml.write_text('format = "lambent-scene"\nversion = 1\ngeometry = "room.obj"\n')
    assert not any("flush" in warning for warning in load_scene(toml).warnings)
    toml.write_text(toml.read_text() + "[objects.lamp]\nluminance = 3000\n")
    scene = load_scene(toml)
    assert any(warning.startswith("1 flush surface (lamp on ceiling): ") for warning in scene.warnings)
    assert (scene.object("lamp").mesh.positions[:, 1] < 3 - RAISED).all(), "below the ceiling, which looks down"
    assert (scene.object("ceiling").mesh.positions[:, 1] == 3).all()


def test_shared_meshes_of_instances_stay_apart() -> None:
    """Two objects of one mesh, one of which is flush: the other does not move."""
    mesh = sheet(1, 1)
    scene = scene_of({"floor": FLOOR, "rug": ("oak", mesh), "far": ("oak", placed(mesh, (9, 0, 0)))})
    before = mesh.positions.copy()
    after = with_flush_raised(scene)
    assert after.object("far") is scene.object("far")
    np.testing.assert_array_equal(mesh.positions, before)
    again = with_flush_raised(replace(after, warnings=()))
    assert not again.warnings, "what has been raised is not flush"
