"""Solids that look inwards are turned, rooms are not; other units and impossible materials are told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from lambent.core.geometry.triangles import triangle_normals
from lambent.core.plain import as_folder
from lambent.core.views.camera import Camera
from lambent.scenes.geometry import box, patch, placed, transformed
from lambent.scenes.loaders.meshes.inverted import looks_inwards, with_solids_outwards
from lambent.scenes.loaders.meshes.repair import MeshArrays, mesh_of
from lambent.scenes.scene import Scene, SceneObject
from lambent.scenes.validation import reflectance_warnings, size_warnings
from tests.baking.small_scenes import GREY, furnace, turned_inwards

FLOOR = SceneObject("floor", patch((-1, 0, 1), (2, 0, 0), (0, 0, -2)), "grey")
LAMP = SceneObject("lamp", placed(turned_inwards(box((0.2, 0.2, 0.2))), (0, 1, 0)), "grey", emission=(1, 1, 1))


def scene_of(*objects: SceneObject) -> Scene:
    return Scene("lit", objects, {"grey": GREY})


def test_a_lamp_is_turned_outwards_and_named() -> None:
    dark = replace(LAMP, name="shelf", mesh=placed(LAMP.mesh, (0.5, 0, 0)), emission=(0, 0, 0))
    scene = with_solids_outwards(scene_of(FLOOR, LAMP, dark))
    assert not looks_inwards(scene.object("shelf").mesh)
    mesh = scene.object("lamp").mesh
    away = mesh.positions - mesh.positions.mean(axis=0)
    assert ((mesh.normals * away).sum(axis=1) > 0).all()
    assert not looks_inwards(mesh)
    assert scene.object("floor") is FLOOR
    assert "faces of lamp and shelf look inwards" in scene.warnings[-1]


def test_against_the_winding_too() -> None:
    mesh = replace(LAMP.mesh, faces=np.ascontiguousarray(LAMP.mesh.faces[:, ::-1]))
    assert looks_inwards(mesh)
    assert not looks_inwards(replace(mesh, normals=-mesh.normals))


def test_what_shines_into_a_room_stays() -> None:
    room = replace(furnace().objects[0], mesh=placed(furnace().objects[0].mesh, (0, 0.5, 0)))
    thing = SceneObject("thing", box((0.1, 0.1, 0.1)), "grey")
    looked_at = replace(scene_of(room), cameras=(Camera("view", (0, 0, 0.5), (0, 0, 0)),))
    for scene in (scene_of(room, thing), looked_at, scene_of(FLOOR), scene_of(replace(LAMP, mesh=FLOOR.mesh), thing)):
        assert with_solids_outwards(scene) is scene


def test_a_room_in_centimetres_is_asked_about() -> None:
    """Its extent could be that of a village, the sizes of its things could not."""
    sides = (360, 300, 250, 120, 90)
    room = scene_of(*(SceneObject(f"part_{side}", box((side, side / 2, 5)), "grey") for side in sides))
    assert "half of the objects are larger than 250 m: is its unit the metre?" in size_warnings(room)[0]
    metres = replace(
        room, objects=tuple(replace(o, mesh=transformed(o.mesh, np.diag([0.01] * 3 + [1]))) for o in room.objects)
    )
    assert not size_warnings(metres)


def test_doubled_faces_are_dropped_and_normals_do_not_cancel() -> None:
    """The file's normals are means of faces and their copies: none has a direction."""
    solid = box((1, 1, 1))
    twice = np.concatenate([solid.faces, solid.faces[:, ::-1]])
    for normals in (None, np.zeros_like(solid.positions)):
        mesh, notes = mesh_of(MeshArrays(solid.positions, twice, normals), name="box", file=Path("box.glb"))
        assert mesh is not None and len(mesh.faces) == 12
        assert np.abs((mesh.normals[mesh.faces] * triangle_normals(mesh.corners)[:, None]).sum(axis=2) - 1).max() < 1e-6
        assert "box: 12 triangles dropped: doubled" in notes
    apart = np.concatenate([solid.faces, solid.faces[:, ::-1] + len(solid.positions)])
    both = MeshArrays(np.tile(solid.positions, (2, 1)), apart, np.concatenate([solid.normals, -solid.normals]))
    kept, _ = mesh_of(both, name="sign", file=Path("sign.glb"))
    assert kept is not None and len(kept.faces) == 24, "copies with normals of their own may shine on both sides"


def test_every_name_has_a_folder_of_its_own(tmp_path: Path) -> None:
    odd = ["..", ".", "", "a/../b", "long " * 60, "long " * 61, "\N{CHAIR}" * 80, "a\nb", "/", "a\x00b"]
    folders = [as_folder(name) for name in odd]
    assert len({*folders}) == len(odd)
    for name in folders:
        (tmp_path / name).mkdir()
    assert len(list(tmp_path.iterdir())) == len(odd)
    assert [as_folder(name) for name in ("wall_1", "Küche", "a/b", "glass: clear")] == [
        "wall_1", "Küche", "a/b", "glass: clear"
    ]  # fmt: skip


def test_a_material_that_makes_light_is_named() -> None:
    scene = scene_of(FLOOR)
    assert not reflectance_warnings(scene)
    bright = replace(scene, materials={"grey": GREY.model_copy(update={"kd": (0.9, 0.2, 0.2), "kt_d": (0.5, 0, 0)})})
    assert "material grey: reflects more light than arrives (1.4)" in reflectance_warnings(bright)[0]


def test_a_material_that_keeps_light_for_longer_than_paths_is_named() -> None:
    def said(kd: float) -> list[str]:
        grey = GREY.model_copy(update={"kd": (kd, 0.5, 0.5)})
        return reflectance_warnings(replace(scene_of(FLOOR), materials={"grey": grey}))

    assert not said(0.96)  # white in glTF
    assert "material grey: reflects almost all light (1): closed rooms of it become too dark" in said(1.0)[0]
