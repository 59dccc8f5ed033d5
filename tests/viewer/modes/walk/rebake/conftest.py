"""Stores of the built-in box, and recorded bakes of it."""

import pytest

from lambent.baking.bake import bake
from lambent.scenes.loaders.load import load_scene
from tests.baking.small_scenes import TINY
from tests.viewer.modes.walk.rebake.recorded_bakes import Box, painted


@pytest.fixture(scope="session")
def boxes(baked_box, adapter, tmp_path_factory):
    """The box with and without light groups, and its bakes in the materials of `painted`."""
    grouped = tmp_path_factory.mktemp("grouped") / "box.store"
    bake(load_scene("builtin:box"), grouped, quality=TINY, light_groups="scene").close()
    made = {
        groups: Box(store, tmp_path_factory.mktemp("recordings"))
        for groups, store in (("none", baked_box), ("scene", grouped))
    }
    for box in made.values():
        box.record("painted", painted(load_scene("builtin:box")))
    return made


@pytest.fixture(scope="session")
def store(boxes):
    return boxes["none"].store
