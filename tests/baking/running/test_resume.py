"""What is baked again and what is not; kill -9 at any moment."""

from __future__ import annotations

import logging
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.scenes.scene import Scene
from lambent.store.contract import scene_record
from lambent.store.source import changed_inputs
from lambent.store.store import Store
from tests.baking.small_scenes import TINY, room_with_step

TILED = TINY.changed(geometry={"texels": 96}, light_map={"samples": (32, 32), "gather_samples": 8, "tile_texels": 40})
KINDS = ("light_map", "probe")
BAKE = """
import sys
from pathlib import Path
from lambent.baking.bake import bake
from tests.baking.running.test_resume import TILED
from tests.baking.small_scenes import room_with_step
bake(room_with_step(), Path(sys.argv[1]), quality=TILED, only=["light_map"])
"""


def arrays(store: Store) -> dict[str, bytes]:
    return {a.name: store.read(a.name).tobytes() for a in store.artefacts()}


def keys(store: Store) -> dict[str, str]:
    return {a.name: a.key for a in store.artefacts()}


@pytest.mark.long
def test_killed_and_resumed_is_the_same_bit_for_bit(tmp_path: Path) -> None:
    """Killed in the path traced map; `test_light_groups_baked` interrupts the gathered one."""
    whole = bake(room_with_step(), tmp_path / "whole", quality=TILED, only=["light_map"])
    path = tmp_path / "killed"
    process = subprocess.Popen([sys.executable, "-c", BAKE, str(path)], cwd=Path(__file__).parents[3])
    while process.poll() is None and done(path) < 1:
        time.sleep(0.02)
    process.kill()
    process.wait()
    assert 1 <= done(path) < 2 * len(whole.artefact("light_map/traced").done)
    before = Store.open(path)
    assert "light_map/irradiance" not in before
    with pytest.raises(UserError, match=r"partial|not in the store"):
        before.read("light_map/irradiance")
    assert arrays(bake(room_with_step(), path, quality=TILED, only=["light_map"])) == arrays(whole)


def done(path: Path) -> int:
    """Tiles of the light maps on disk, path traced and gathered."""
    if not (path / "manifest.json").exists():
        return 0
    names = ("light_map/traced", "light_map/gathered")
    return sum(len(a.done) for a in Store.open(path).artefacts() if a.name in names)


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> tuple[Scene, Path]:
    scene, path = room_with_step(), tmp_path_factory.mktemp("store") / "s"
    bake(scene, path, quality=TINY, only=KINDS)
    return scene, path


def test_only_what_depends_on_a_change_is_baked_again(baked: tuple[Scene, Path]) -> None:
    scene, path = baked
    before, timings = keys(Store.open(path)), Store.open(path).documents["timings"]
    view = Camera("new", (0, 1, 1), (0, 0, 0))
    store = bake(replace(scene, cameras=(view,)), path, quality=TINY, only=KINDS)
    assert keys(store) == before and store.documents["timings"] == timings
    assert scene_record(store).cameras[0].name == "new"
    darker = replace(scene, materials={**scene.materials, "grey": Material(kd=0.2)})
    after = keys(bake(darker, path, quality=TINY, only=["light_map"]))
    assert {name for name in before if after[name] != before[name]} == {n for n in before if n.startswith("light_map/")}
    assert keys(bake(scene, path, quality=TINY, only=KINDS)) == before


@pytest.mark.long
def test_anew_on_request_is_the_same_and_another_seed_is_not(baked: tuple[Scene, Path], tmp_path: Path) -> None:
    scene, path = baked
    before, calls = arrays(Store.open(path)), list[str]()

    def progress(done: float, total: float, what: str) -> None:
        calls.append(what)

    store = bake(scene, path, quality=TINY, only=KINDS, resume=False, progress=progress)
    assert "light map, traced" in calls and arrays(store) == before
    calls.clear()
    bake(scene, path, quality=TINY, only=KINDS, progress=progress)
    assert not calls, "nothing left to do"
    other = bake(scene, tmp_path / "s", quality=TINY, only=["light_map"], seed=1)
    assert "probe/ball/radiance" not in other and "geometry/uv2" in other
    assert not np.array_equal(other.read("light_map/traced"), store.read("light_map/traced"))


def test_a_changed_file_is_said(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    source = tmp_path / "scene.toml"
    source.write_text("one")
    scene = replace(room_with_step(), sources=(source,))
    store = bake(scene, tmp_path / "s", quality=TINY, only=["geometry"])
    assert changed_inputs(store, scene) == []
    source.write_text("two")
    assert changed_inputs(Store.open(tmp_path / "s"), scene) == ["scene.toml"]
    with caplog.at_level(logging.WARNING):
        store = bake(scene, tmp_path / "s", quality=TINY, only=["geometry"])
    assert "scene.toml" in caplog.text and store.documents["changes"] == ["scene.toml"]


@pytest.mark.parametrize(
    ("scene", "options", "message"),
    [
        (room_with_step(), {"quality": "prewiev"}, "did you mean"),
        (room_with_step(), {"only": ["lightmap"]}, "did you mean"),
        (Scene("empty", (), {}), {}, "no objects"),
    ],
    ids=["unknown quality", "unknown kind", "empty scene"],
)
def test_what_cannot_be_baked_is_told(tmp_path: Path, scene: Scene, options: dict[str, object], message: str) -> None:
    with pytest.raises(UserError, match=message):
        bake(scene, tmp_path / "s", **options)
