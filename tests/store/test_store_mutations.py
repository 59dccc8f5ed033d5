"""A small store whose manifest or chunks lie: one `UserError` names what is wrong."""

from __future__ import annotations

import json
import os
import shutil
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numcodecs import Zstd

from lambent.core.errors import UserError
from lambent.core.views.camera import Camera, CameraPath
from lambent.materials.document import Lobe, Material
from lambent.scenes.floor_plan import FloorPlan
from lambent.scenes.scene import MaterialTextures, Texture
from lambent.store.chunk_files import content_size
from lambent.store.contract import (
    SIDES,
    ObjectRecord,
    ReflectorPart,
    ReflectorRecord,
    SceneRecord,
    view_artefact_name,
    view_meta,
    write_scene_record,
)  # fmt: skip
from lambent.store.kept.views import Views, change_views
from lambent.store.light_groups import group_name, light_groups
from lambent.store.occlusion import PROBE_SHARE, probe_shares
from lambent.store.plans import plan_record
from lambent.store.store import Store
from lambent.store.textures import texture_records, write_textures
from tests.reliability.mutate import LONGEST_S, within
from tests.reliability.readers import use_store

FRONT = Camera("front", (0.0, 1.0, 3.0), (0.0, 1.0, 0.0))


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store with every kind of array and document, one of them unfinished, one rewritten."""
    folder = tmp_path_factory.mktemp("sound") / "store"
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], np.float32)
    cube = np.ones((6, 4, 4, 3), np.float16)
    arrays: dict[str, tuple[Any, dict[str, Any]]] = {
        "geometry/positions": (corners, {}),
        "geometry/normals": (np.tile(np.float32([0, 1, 0]), (4, 1)), {}),
        "geometry/tangents": (np.tile(np.float32([1, 0, 0]), (4, 1)), {}),
        "geometry/uv": (corners[:, ::2], {}),
        "geometry/uv2": (corners[:, ::2], {"light_map_size": [4, 4]}),
        "geometry/faces": (np.array([[0, 1, 2], [0, 2, 3]], np.uint32), {}),
        "light_map/irradiance": (np.ones((4, 4, 3), np.float16), {"noise": 0.1}),
        "light_map/noise": (np.ones((4, 4), np.float16), {}),
        "environment/radiance": (cube, {}),
        "probe/floor/radiance": (cube, {"centre": [0.0, 1.0, 0.0], "seen_irradiance": [1.0] * 9}),
        "probe/floor/distance": (cube[..., 0].astype(np.float32), {}),
        "probe/floor/planes": (np.float32([[0, 1, 0, 0]]), {}),
        view_artefact_name(FRONT, 0, 0, "vectors", "x"): (np.ones((2, 2), np.float32), view_meta(FRONT)),
    }
    textures = {"wood": MaterialTextures(diffuse=Texture(np.ones((2, 2, 3), np.float16)))}
    plan = FloorPlan(*np.eye(3), 0.5, np.zeros((3, 4), np.int8))
    floor = ObjectRecord(name="floor", material="wood", first_face=0, face_count=2, bounds=((0, 0, 0), (1, 0, 1)),
                         probe=True)  # fmt: skip
    reflector = ReflectorRecord(plane=(0, 1, 0, 0), outline=((0, 0, 0), (1, 0, 0), (1, 0, 1)), plan=plan_record(plan),
                                parts=(ReflectorPart(object="floor", faces=(0, 1), area_m2=1.0),))  # fmt: skip
    with Store.create(folder, {"room.toml": "0" * 64}) as store:
        for name, (array, meta) in arrays.items():
            store.put(name, name.split("/")[0], array, key="k", meta=meta)
        write_textures(store, textures)
        half = store.begin("light_map/raw", "raw", (4, 4), (2, 4), "float32", key="k")
        half.write((0, 0), np.float32(1))
        half.write((0, 0), np.float32(2))
        store.set_document("timings", {"light_map": 1.5})
        store.set_document("source", "builtin:box")
        record = SceneRecord(
            name="room", objects=(floor,), cameras=(FRONT,), paths=(CameraPath("walk", (FRONT, FRONT)),),
            materials={"wood": Material(name="wood", kd=0.5, lobes=(Lobe(mx=0.1, my=0.2),))}, reflectors=(reflector,),
            bounds=((0, 0, 0), (1, 0, 1)), textures=texture_records(textures),
        )  # fmt: skip
        write_scene_record(store, record)
        half.write((1, 0), np.float32(3))  # in the journal alone
    change_views(folder, lambda _: Views(cameras=(FRONT,), paths=(CameraPath("tour", (FRONT,) * 2, 2.0, (0.0, 2.0)),)))
    use_store(folder)
    return folder


ARRAYS = ("artefacts",)
SCENE = ("documents", "scene")
BIG = 15 << 30


@pytest.mark.parametrize(
    ("place", "value", "word"),
    [
        ((*ARRAYS, "light_map/raw", "done"), {"7.0": 1}, "unknown chunk 7.0"),
        ((*ARRAYS, "light_map/raw", "done"), {"00.0": 1}, "unknown chunk 00.0"),
        ((*ARRAYS, "light_map/raw", "done"), {"..": 1}, "unknown chunk"),
        ((*ARRAYS, "light_map/raw", "done"), {"0.0": [1, -1]}, "not a count"),
        ((*ARRAYS, "light_map/raw", "shape"), [4.0, 4], "not a count"),
        ((*ARRAYS, "light_map/raw", "shape"), [-4, 4], "not a count"),
        ((*ARRAYS, "light_map/raw", "shape"), [4], "manifest is damaged"),
        ((*ARRAYS, "light_map/raw", "done"), 7, "manifest is damaged"),
        ((*ARRAYS, "geometry/uv", "done"), {}, "complete with 0 chunks"),
        ((*ARRAYS, "light_map/raw", "dtype"), "O", "unknown dtype"),
        ((*ARRAYS, "light_map/raw", "dtype"), "S1000000000", "unknown dtype"),
        ((*ARRAYS, "light_map/raw", "dtype"), [["a", "f4"]], "must be text"),
        ((*ARRAYS, "light_map/raw", "chunks"), [BIG, BIG], "impossible chunks"),
        ((*ARRAYS, "light_map/raw", "chunks"), [0, 4], "impossible chunks"),
        ((*ARRAYS, "light_map/raw", "shape"), [1 << 22, 4], "too many chunks"),
        ((*ARRAYS, "geometry/uv", "shape"), [3, 2], "chunk cannot be read|arrays have different lengths|chunk"),
        ((*ARRAYS, "geometry/faces", "dtype"), "float32", "array has the wrong shape or type"),
        ((*ARRAYS, "probe/floor/radiance", "meta"), {}, "centre"),
        ((*ARRAYS, "probe/floor/radiance", "meta", "centre"), [0, float("nan"), 0], "3 finite numbers"),
        ((*ARRAYS, "probe/floor/radiance", "meta", "seen_irradiance"), [1] * 8, "9 finite numbers"),
        ((*ARRAYS, "probe/floor/radiance", "meta", "unit"), 0, "a number from 1"),
        ((*ARRAYS, "environment/radiance", "meta", "unit"), float("nan"), "a number from 1"),
        ((*SCENE, "objects", 0, "material"), "woof", "unknown material; found woof"),
        ((*SCENE, "objects", 0, "face_count"), 3, "face index out of range"),
        ((*SCENE, "objects", 0, "first_face"), -1, "face index out of range"),
        ((*SCENE, "reflectors", 0, "parts", 0, "object"), "flood", "unknown object; found flood"),
        ((*SCENE, "reflectors", 0, "parts", 0, "faces"), [2], "face index out of range"),
        ((*SCENE, "cameras", 0, "fov_y_deg"), float("nan"), "impossible field of view"),
        ((*SCENE, "textures"), {"woof": {"parts": {}}}, "unknown material"),
        ((*SCENE, "exposure_ev"), float("inf"), "not finite"),
        ((*SCENE, "materials", "wood", "name"), "\ud800", "manifest"),
        ((*SCENE, "materials", "wood", "kd"), [10**400] * 3, "manifest"),
        ((*SCENE,), "a text", "manifest"),
        (("documents",), [], "no scene record"),
        (("documents",), 3, "manifest is damaged"),
        (("inputs",), 3, "manifest is damaged"),
    ],
)
def test_what_is_wrong_is_named(sound: Path, tmp_path: Path, place: tuple[Any, ...], value: Any, word: str) -> None:
    folder = tmp_path / "store"
    shutil.copytree(sound, folder)
    manifest = json.loads((folder / "manifest.json").read_text())
    parent = manifest
    for key in place[:-1]:
        parent = parent[key]
    parent[place[-1]] = value
    (folder / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(UserError, match=word) as caught:
        use_store(folder)
    assert str(folder) in str(caught.value)


@pytest.mark.parametrize("name", ["../../x", "/etc", "", ".", "a/../geometry/uv", "a/..", "\0", "x" * 5000])
def test_names_that_are_paths(sound: Path, tmp_path: Path, name: str) -> None:
    folder = tmp_path / "store"
    shutil.copytree(sound, folder)
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["artefacts"][name] = manifest["artefacts"].pop("light_map/raw")
    (folder / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(UserError):
        use_store(folder)


def test_a_number_of_5000_digits(sound: Path, tmp_path: Path) -> None:
    for file in ("manifest.json", "views.json"):
        folder = tmp_path / file / "store"
        shutil.copytree(sound, folder)
        text = (folder / file).read_text()
        (folder / file).write_text(text.replace('"version": ', f'"version": {"9" * 5000}', 1))
        with pytest.raises(UserError, match=file):
            use_store(folder)


@pytest.mark.parametrize("chunk", [[1 << 15, 1 << 15, 3], [1 << 10, 1 << 10, 3]])
def test_an_array_of_15_gb_without_files_is_refused_before_it_is_made(tmp_path: Path, chunk: list[int]) -> None:
    Store.create(tmp_path / "s", {}).close()
    manifest = json.loads((tmp_path / "s/manifest.json").read_text())
    shape = [1 << 15, (BIG >> 15) // 6, 3]
    counts = [-(-size // step) for size, step in zip(shape, chunk, strict=True)]
    done = {f"{i}.{j}.0": 0 for i in range(counts[0]) for j in range(counts[1])}
    manifest["artefacts"]["light_map/irradiance"] = {
        "kind": "light_map", "shape": shape, "chunks": chunk, "dtype": "float16", "key": "k", "meta": {}, "done": done,
        "complete": True,
    }  # fmt: skip
    (tmp_path / "s/manifest.json").write_text(json.dumps(manifest))
    store = Store.open(tmp_path / "s")
    with within(LONGEST_S), pytest.raises(UserError, match=r"almost no data on disk|does not fit into memory"):
        store.read("light_map/irradiance")


def test_a_small_frame_that_claims_much_is_refused(tmp_path: Path) -> None:
    """The size that a compressed chunk claims is compared before it is unpacked."""
    with Store.create(tmp_path / "s", {}) as store:
        store.put("a", "x", np.ones((4, 4), np.float32), key="k")
    bomb = bytes(Zstd().encode(np.ones(1 << 22, np.uint8)))
    assert content_size(bomb) == 1 << 22 and content_size(bytes(Zstd().encode(b"abc"))) == 3
    assert (
        content_size(bytes(Zstd().encode(bytes(300)))) == 300 and content_size(b"") == content_size(b"abcdefgh") == -1
    )
    (tmp_path / "s/a/c/0/0").write_bytes(bomb)
    manifest = json.loads((tmp_path / "s/manifest.json").read_text())
    manifest["artefacts"]["a"]["done"]["0.0"] = zlib.crc32(bomb)
    (tmp_path / "s/manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(UserError, match=r"chunk cannot be read .it holds 4194304 bytes, not 64"):
        Store.open(tmp_path / "s").read("a")


@pytest.mark.skipif(not hasattr(os, "symlink"), reason="links are of POSIX")
def test_a_chunk_that_is_a_link_out_of_the_store(sound: Path, tmp_path: Path) -> None:
    folder = tmp_path / "store"
    shutil.copytree(sound, folder)
    (tmp_path / "mine").write_text("mine")
    for name in ("c/0/0.1", "journal"):
        path = folder / "light_map/raw" / name
        path.unlink(missing_ok=True)
        path.symlink_to(tmp_path / "mine")
        with pytest.raises(UserError, match="leaves its folder"), Store.create(folder, {}) as store:
            store.begin("light_map/raw", "raw", (4, 4), (2, 4), "float32", key="k").write((0, 0), np.float32(1))
        path.unlink()
    assert (tmp_path / "mine").read_text() == "mine"


@pytest.mark.parametrize("count", [1, 4])
def test_notes_of_groups_and_shares_must_fit_their_arrays(tmp_path: Path, count: int) -> None:
    """Neither another axis of an array nor one name among others makes them valid."""
    store = Store.create(tmp_path / "s", {})
    named = [{"name": f"g{k}", "members": [], "share": 0.2} for k in range(count)]
    light = np.zeros((2, 4, 5, 3), np.float16)
    store.put(group_name(SIDES[0]), "light_map", light, key="k", meta={"groups": named})
    store.put("light_map/irradiance", "light_map", light[0], key="k")
    names = ["floor", 1] if count == 1 else ["floor"]
    store.put(PROBE_SHARE, "probe_share", np.zeros((4, 5, 4), np.float16), key="k", meta={"objects": names})
    with pytest.raises(UserError, match="2 groups with names of their own"):
        light_groups(store)
    if count == 1:
        with pytest.raises(UserError, match="a list of names"):
            probe_shares(store)
    else:
        assert probe_shares(store)[1] == {"floor"}
