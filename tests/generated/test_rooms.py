"""The generated rooms load whole, and differ by seed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.scenes.loaders.load import load_scene
from tests.generated.rooms import ROOMS, written


@pytest.mark.long
@pytest.mark.parametrize(("name", "lights"), [("gallery", 10), ("workshop", 0)])
def test_rooms_load_whole(name: str, lights: int, tmp_path: Path) -> None:
    scene = load_scene(written(name, tmp_path / "1"))
    assert len(scene.lights) == lights
    assert (scene.environment is None) == (name == "gallery")
    assert {one.material for one in scene.objects} <= set(scene.materials) - {"default"}
    other = load_scene(written(name, tmp_path / "2", seed=2))
    places = [
        np.array([one.mesh.positions.mean(axis=0) for one in room.objects if "_" in one.name])
        for room in (scene, other)
    ]
    assert not (places[0].shape == places[1].shape and np.allclose(*places))


def test_every_room_is_tried() -> None:
    assert set(ROOMS) == {"gallery", "workshop"}
