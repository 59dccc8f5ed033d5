"""Scenes that do not fit into memory are refused before it is taken."""

from dataclasses import replace
from pathlib import Path

import pytest

from lambent.baking import bake as baking
from lambent.core.errors import UserError
from lambent.scenes.geometry import placed, sphere
from lambent.scenes.scene import Scene, SceneObject
from tests.baking.small_scenes import GREY, TINY, furnace


def forest(count: int) -> Scene:
    ball = sphere(0.1, 16, 12)
    objects = (SceneObject(f"tree{i}", placed(ball, (0.3 * i, 0, 0)), "grey") for i in range(count))
    return Scene("forest", (*furnace().objects, *objects), {"grey": GREY})


def test_copies_beyond_memory_are_refused_with_their_number(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    scene = forest(50)
    triangles = sum(len(o.mesh.faces) for o in scene.objects)
    monkeypatch.setattr(baking, "memory_bytes", lambda: baking.BYTES_PER_TRIANGLE * triangles - 1)
    with pytest.raises(UserError, match="tree0 and 49 more objects are copies of 352 triangles"):
        baking.bake(scene, tmp_path / "s", quality=TINY, only={"geometry"})
    assert not (tmp_path / "s").exists()
    baking.check_memory(forest(49))


def test_one_large_object_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = replace(furnace(), objects=(*furnace().objects, SceneObject("big", sphere(1.0, 64, 32), "grey")))
    monkeypatch.setattr(baking, "memory_bytes", lambda: 1000)
    with pytest.raises(UserError, match="big is the largest"):
        baking.check_memory(scene)
