"""The generated rooms under luminaires load whole."""

from __future__ import annotations

from pathlib import Path

import pytest

from lambent.scenes.loaders.load import load_scene
from tests.generated.lit_rooms import LIT_ROOMS, written

LIGHTS = {"foyer": 1, "stair": 3, "office": 16, "shop": 24, "warehouse": 60}


@pytest.mark.parametrize("name", LIT_ROOMS)
def test_rooms_load_whole(name: str, tmp_path: Path) -> None:
    scene = load_scene(written(name, tmp_path / "1"))
    assert len(scene.lights) == LIGHTS[name] and scene.environment is None
    assert {one.material for one in scene.objects} <= set(scene.materials) - {"default"}
    low, high = scene.bounds
    for light in scene.lights:
        assert (low < light.position).all() and (light.position < high).all()  # type: ignore[union-attr]
    if name in ("stair", "shop"):
        assert load_scene(written(name, tmp_path / "2", seed=2)).lights != scene.lights
