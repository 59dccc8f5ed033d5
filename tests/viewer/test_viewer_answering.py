"""The light of edited materials in the walk: computed in a thread, the light map first, then the probes."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from lambent.bake.bake import bake
from lambent.core.camera import Camera
from lambent.realtime.device import open_device
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from lambent.store.store import Store
from lambent.viewer.modes.walk.answering import WITHOUT, Answering, AnsweringLight
from tests.bake.small_scenes import GREY, TINY, room_with_step
from tests.viewer.small_store import write_small_store

VIEW = FrameState(Camera(name="in", position=(1.4, 1.2, -1.4), target=(-0.8, 0.5, 0.0), fov_y_deg=70), 96, 64)
RED = {"grey": GREY.model_copy(update={"kd": (0.5, 0.05, 0.05)})}


def settled(light: AnsweringLight, edited: dict) -> None:
    """Frames until nothing is computed any more."""
    end = time.monotonic() + 60
    light.update(edited)
    while light.busy:
        assert time.monotonic() < end
        time.sleep(0.005)
        light.update(edited)


def test_light_follows_an_edit_and_comes_back(tmp_path: Path) -> None:
    store = bake(room_with_step(), tmp_path / "s", quality=TINY)
    renderer, shown = Renderer(open_device(), store), Answering()
    light = AnsweringLight(store, renderer, shown)
    before, version = renderer.image(VIEW), renderer.light_version
    settled(light, {})
    assert renderer.light_version == version and "as baked" in shown.note, "nothing is computed without an edit"
    settled(light, RED)
    assert renderer.light_version > version and shown.note.endswith("%")
    assert np.abs(renderer.image(VIEW) - before).max() > 0.05 * before.mean()
    settled(light, {})
    assert np.array_equal(renderer.image(VIEW), before) and "as baked" in shown.note
    light.close()


def test_a_store_without_an_answer_is_named(tmp_path: Path) -> None:
    store = Store.open(write_small_store(tmp_path / "s"))
    shown = Answering()
    settled(AnsweringLight(store, Renderer(open_device(), store), shown), {"plaster": GREY})
    assert not shown.possible and shown.note == WITHOUT
