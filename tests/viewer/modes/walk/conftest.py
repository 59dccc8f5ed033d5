"""A small baked room, for tests that need light of a bake."""

import pytest

from lambent.bake.bake import bake
from lambent.scenes import load_scene
from tests.bake.small_scenes import TINY


@pytest.fixture(scope="session")
def baked_box(mi, tmp_path_factory):
    """Folder of a store of the built-in box."""
    folder = tmp_path_factory.mktemp("baked") / "box.store"
    bake(load_scene("builtin:box"), folder, quality=TINY).close()
    return folder
