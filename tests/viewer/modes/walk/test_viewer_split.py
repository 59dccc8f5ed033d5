"""Two states of the room beside each other: each side is the picture of its state, in its light, and both are live."""

import time
from dataclasses import replace

import numpy as np
import pytest

from lambent.core.light.light_mix import GroupMix, LightMix
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import open_device
from lambent.realtime.renderer import Renderer
from lambent.store.kept.session import RoomState
from lambent.store.store import Store
from lambent.viewer.modes.walk.pictures import Pictures
from lambent.viewer.modes.walk.session.states import AS_BAKED
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.screen import Rect
from tests.viewer.drawn_frames import drawn
from tests.viewer.small_store import MATERIALS, SIDE, with_light_groups, write_small_store

SIZE = 48, 32
PLACE = Rect(0, 0, *SIZE)
LONGEST_S = 60.0  # until a picture rests, however busy the machine is
OFF = LightMix({"lamp": GroupMix(on=False), "sky": GroupMix(intensity=2.0)})
RED = MATERIALS["plaster"].model_copy(update={"kd": (0.6, 0.1, 0.1)})


@pytest.fixture(scope="module")
def store(adapter, tmp_path_factory):
    return with_light_groups(write_small_store(tmp_path_factory.mktemp("split") / "small"))


@pytest.fixture
def renderer(store):
    return Renderer(open_device(), Store.open(store))


@pytest.fixture
def state(renderer, screen):
    screen.pace.adaptive = False
    state = WalkState.of(renderer.scene.record, "walk", screen)
    state.lights.groups = renderer.scene.groups.records
    state.look.exposure_ev, state.meter.expose_wanted = 0.0, False
    return state


@pytest.fixture
def pictures(renderer, state):
    made = Pictures(renderer, state)
    yield made
    made.close()


def rested(pictures, state):
    """Frames until nothing more is to come."""
    end_s = time.monotonic() + LONGEST_S
    while time.monotonic() < end_s:
        drawn(pictures, state, SIZE, dt_s=0.0)
        if pictures.wait_s() is None:
            return
        state.screen.clock.now_s += 0.3
    raise AssertionError("the picture does not come to rest")


def alone(store, state, room):
    """Radiance of a state by a renderer of its own, at rest."""
    other = WalkState.of(state.scene, "walk", state.screen)
    other.lights.groups, other.navigation.camera = state.lights.groups, state.navigation.camera
    other.look.exposure_ev, other.meter.expose_wanted = 0.0, False
    other.materials.edits.take(room)
    pictures = Pictures(Renderer(open_device(), Store.open(store)), other)
    rested(pictures, other)
    return pictures._a.read()


@pytest.mark.long
def test_each_side_is_its_state_and_both_follow_the_camera(pictures, state, store):
    edits = state.materials.edits
    edits.change("plaster", RED)
    edits.mix(OFF)
    edits.compare_with(AS_BAKED)
    state.states.split = True
    for camera in (state.navigation.camera, SIDE):
        state.navigation.camera = camera
        rested(pictures, state)
        a, b = (picture.read() for picture in pictures.shown)
        assert pictures.divider is state.states.divider
        np.testing.assert_array_equal(a, alone(store, state, edits.room))
        np.testing.assert_array_equal(b, alone(store, state, AS_BAKED))
        assert np.abs(a - b).mean() > 0.1 * b.mean()


@pytest.mark.long
def test_an_exchange_takes_one_frame_and_computes_nothing(pictures, state):
    edits = state.materials.edits
    edits.change("plaster", RED)
    edits.mix(OFF)
    state.states.split = True
    rested(pictures, state)
    a, b = (picture.read() for picture in pictures.shown)
    versions = {lane.renderer.mixer.version for lane in (pictures._lane, pictures._other_lane)}
    for first, second in ((b, a), (a, b)):
        state.states.exchange()
        pictures.update(PLACE, 1.0)
        now = [picture.read() for picture in pictures.shown]
        np.testing.assert_array_equal(now[0], first)
        np.testing.assert_array_equal(now[1], second)
    assert versions == {lane.renderer.mixer.version for lane in (pictures._lane, pictures._other_lane)}
    edits.undo()
    edits.undo()
    pictures.update(PLACE, 1.0)
    np.testing.assert_array_equal(pictures.shown[0].read(), a)


@pytest.mark.long
def test_a_split_ends_other_comparisons_and_the_room_alone_comes_back(pictures, state):
    state.materials.edits.change("plaster", RED)
    state.states.split = True
    rested(pictures, state)
    state.states.split = False
    rested(pictures, state)
    assert len(pictures.shown) == 1 and pictures.divider is None


@pytest.mark.long
def test_films_have_the_light_and_the_textures_of_the_room(pictures, state, renderer):
    """Their renderer has light of its own where there are light groups."""
    edits = state.materials.edits
    edits.take(RoomState(materials={"plaster": RED}, textures={"plaster": "brass"}))
    rested(pictures, state)
    dimmed = replace(renderer.scene.groups, _probes={})
    renderer.mixer.answer(dimmed)
    state.films.file_name = "tour.mp4"
    film = pictures._filming(state.scene.paths[0])
    assert pictures._film_renderer is not renderer and pictures._film_renderer.mixer.groups is dimmed
    worn = pictures._film_renderer.resources.materials
    assert worn["plaster"] is pictures._film_renderer.resources._textured["brass"]
    film.cancel()


def test_a_second_renderer_shares_what_no_edit_changes_and_draws_the_same(adapter, tmp_path):
    """Light as baked is shared by probe; light that one of both gets is not the other's."""
    first = Renderer(open_device(), Store.open(write_small_store(tmp_path / "s")))
    second = Renderer(first.device, first.scene, kin=first)
    both = list(zip(first.resources.objects, second.resources.objects, strict=True))
    assert all(a.light is b.light and a is not b for a, b in both)
    frame = FrameState(first.scene.record.cameras[0], 48, 32)
    before = first.image(frame)
    np.testing.assert_array_equal(second.image(frame), before)
    item = second.resources.objects[0]
    item.relight(item.light.relit(item.light.probe.radiance * 0, ()), item.emission)
    second.resources.show_light_map([layer * 0 for layer in second.resources.light_layers])
    assert second.image(frame).mean() < before.mean()
    np.testing.assert_array_equal(first.image(frame), before)
