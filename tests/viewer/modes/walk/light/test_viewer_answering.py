"""The light of edited materials in the walk: computed in a thread, the light map first, then the probes."""

from __future__ import annotations

import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baked.answering.stored import read_answer
from lambent.baking.bake import bake
from lambent.core.views.camera import Camera
from lambent.realtime.answering.answer_shown import answered
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import open_device
from lambent.realtime.light.baked import read_baked
from lambent.realtime.light.probe_light import ProbeLight
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import placed, sphere
from lambent.scenes.scene import SceneObject
from lambent.store.store import Store
from lambent.viewer.modes.walk.light import answering
from lambent.viewer.modes.walk.light.answering import WITHOUT, Answering, AnsweringLight
from tests.baking.small_scenes import GREY, TINY, room_with_step
from tests.realtime.answering.answered_scene import answered_scene
from tests.viewer.small_store import write_small_store
from tests.viewer.waiting import until

VIEW = FrameState(Camera(name="in", position=(1.4, 1.2, -1.4), target=(-0.8, 0.5, 0.0), fov_y_deg=70), 96, 64)
BLUE = {"grey": GREY.model_copy(update={"kd": (0.05, 0.05, 0.5)})}
RED = {"grey": GREY.model_copy(update={"kd": (0.5, 0.05, 0.05)})}


def settled(light: AnsweringLight, edited: dict) -> None:
    """Frames until nothing is computed any more."""
    light.update(edited)
    until(lambda: not light.busy, lambda: light.update(edited))


@pytest.fixture(scope="module")
def store(adapter: None, tmp_path_factory: pytest.TempPathFactory) -> Store:
    """The room with a second ball, for two probes."""
    second = SceneObject("other ball", placed(sphere(0.3, 16, 8), (0.8, 1.2, -0.8)), "mirror")
    room = replace(room_with_step(), objects=(*room_with_step().objects, second))
    return bake(room, tmp_path_factory.mktemp("answering") / "s", quality=TINY)


def test_light_follows_an_edit_and_comes_back(store: Store) -> None:
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


def test_an_edit_drops_the_probes_of_the_one_before(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first edit's probes are given up after the one under way, and made where the edit comes back."""
    renderer, made, go_on = Renderer(open_device(), store), list[str](), threading.Event()
    light = AnsweringLight(store, renderer, Answering())
    assert len(read_answer(store).seen) == 2

    def slow(*given: object) -> ProbeLight:
        made.append(str(given[2]))
        assert go_on.wait(60)
        return answered(*given)

    monkeypatch.setattr(answering, "answered", slow)
    until(lambda: made, lambda: light.update(RED))
    light.update(BLUE)
    go_on.set()
    settled(light, RED)
    assert len(made) == 3, "one probe of the first try, and both of the second"
    shown = renderer.image(replace(VIEW, materials=RED))
    light.close()
    fresh = Renderer(open_device(), answered_scene(read_baked(store), read_answer(store), RED))
    assert np.allclose(shown, fresh.image(VIEW), rtol=0.02, atol=0.01 * shown.mean())


@pytest.mark.long
def test_a_store_with_light_groups_answers_in_its_mix(tmp_path: Path) -> None:
    store = bake(room_with_step(), tmp_path / "s", quality=TINY, light_groups="scene")
    renderer, shown = Renderer(open_device(), store), Answering()
    light, mix = AnsweringLight(store, renderer, shown), replace(VIEW, light={"lamp": (0.5, 0.5, 0.5)})
    before = renderer.image(mix)
    settled(light, RED)
    assert shown.possible and shown.note.endswith("%")
    answered_then_mixed = renderer.image(mix)
    assert np.allclose(2 * answered_then_mixed, renderer.image(VIEW), rtol=6e-3, atol=4e-3)
    assert np.abs(answered_then_mixed - before).max() > 0.05 * before.mean()
    settled(light, {})
    assert np.array_equal(renderer.image(mix), before) and "as baked" in shown.note
    light.close()


def test_light_stays_as_baked_where_an_object_is_replaced(store: Store) -> None:
    renderer, shown = Renderer(open_device(), replace(read_baked(store), replaced=True)), Answering()
    light = AnsweringLight(store, renderer, shown)
    version = renderer.light_version
    settled(light, RED)
    assert not shown.possible and "replaced" in shown.note and renderer.light_version == version
