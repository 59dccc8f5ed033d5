"""A store that several benches measure."""

from __future__ import annotations

from pathlib import Path

import pytest

from lambent.baking.bake import bake
from lambent.baking.quality import quality_named
from lambent.scenes.loaders.load import load_scene

COARSE = quality_named("preview").changed("coarse", geometry={"texels": 64}, environment={"texels": 32})


@pytest.fixture(scope="session")
def coarse_box(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a coarse box with light groups."""
    folder = tmp_path_factory.mktemp("baked") / "box.store"
    bake(load_scene("builtin:box"), folder, quality=COARSE, light_groups="scene")
    return folder
