"""A material that is dragged stays sharp where frames in motion have fewer pixels; what is selected is outlined."""

from dataclasses import replace

import numpy as np
import pytest

from lambent.realtime.light.baked import read_baked
from lambent.realtime.renderer import Renderer
from lambent.store.store import Store
from lambent.viewer.modes.walk.pictures import Pictures
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.screen import Rect
from tests.viewer.small_store import SIDE, write_small_store

PLACE = Rect(0, 0, 96, 64)


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return read_baked(Store.open(write_small_store(tmp_path_factory.mktemp("sharp") / "small")))


@pytest.fixture
def renderer(device, scene):
    return Renderer(device, scene)


@pytest.fixture
def state(renderer, screen):
    return WalkState.of(renderer.scene.record, "walk", screen)


@pytest.fixture
def pictures(renderer, state):
    """On an adapter that is slow: a quarter of the width and height in motion."""
    found = Pictures(renderer, state)
    slow_down(found)
    found.update(PLACE, 1.0)
    assert state.screen.statistics.resolution == (24, 16)
    return found


def slow_down(pictures):
    for size in pictures._a.pacer._sizes.values():
        size.scale = 0.25


def pull(state, red):
    brass = state.scene.materials["brass"].model_copy(update={"kd": (red, 0.0, 0.0)})
    state.materials.edits.change("brass", brass)


def shown(pictures):
    """Light of the picture, of which 255 is white."""
    return 255 * pictures._a.read()


def test_the_dragged_material_is_drawn_at_full_size(pictures, state):
    for red in (0.2, 0.5):
        pull(state, red)
        pictures.update(PLACE, 1.0)
        assert state.screen.statistics.resolution == (96, 64)
    ball = shown(pictures)[25:40, 42:54]
    assert (ball[..., 0] > ball[..., 2] + 20).all(), "what is shown is the last one"
    slow_down(pictures)
    state.navigation.jump(SIDE)
    pictures.update(PLACE, 1.0)
    assert state.screen.statistics.resolution == (24, 16), "a moving camera has fewer pixels, as before"


def test_the_whole_frame_follows_at_rest(pictures, state):
    pull(state, 0.5)
    pictures.update(PLACE, 1.0)
    over = shown(pictures)
    state.screen.clock.now_s += 1.0
    pictures.update(PLACE, 1.0)
    whole = shown(pictures)
    assert np.array_equal(over[25:40, 42:54], whole[25:40, 42:54])
    assert abs(over - whole).max() > 2, "around the ball it was the small frame"


def relight(renderer, factor):
    """As an answer does: another light map, and a new version of the light."""
    layers = [np.asarray(layer * np.float16(factor), np.float16) for layer in renderer.resources.light_layers]
    renderer.resources.show_light_map(layers)
    renderer.resources.light_version += 1


def test_light_that_follows_an_edit_is_shown_at_once_and_sharp_at_rest(pictures, state, renderer):
    rest(pictures, state)
    before = shown(pictures)
    slow_down(pictures)
    relight(renderer, 0.25)
    pictures.update(PLACE, 1.0)
    assert state.screen.statistics.resolution == (24, 16)
    rest(pictures, state)
    assert shown(pictures).mean() < 0.6 * before.mean()


def test_changes_that_take_long_are_drawn_as_motion_is(pictures, state):
    """Of the materials whose changes took long, and of no other."""
    pictures._a._over_s[frozenset({"brass"})] = 10.0
    slow_down(pictures)
    pull(state, 0.2)
    pictures.update(PLACE, 1.0)
    assert state.screen.statistics.resolution == (24, 16)
    rest(pictures, state)
    plaster = state.scene.materials["plaster"].model_copy(update={"kd": (0.2, 0.2, 0.2)})
    state.materials.edits.change("plaster", plaster)
    pictures.update(PLACE, 1.0)
    assert state.screen.statistics.resolution == (96, 64)


def test_light_during_a_drag_is_shown_soon(pictures, state, renderer):
    rest(pictures, state)
    pull(state, 0.2)
    assert state.materials.edits.in_stroke
    pictures.update(PLACE, 1.0)
    slow_down(pictures)
    relight(renderer, 0.5)
    pictures.update(PLACE, 1.0)
    assert state.screen.statistics.resolution == (24, 16)
    state.materials.edits.end_stroke()
    slow_down(pictures)
    relight(renderer, 0.5)
    pictures.update(PLACE, 1.0)
    assert state.screen.statistics.resolution == (24, 16), "a coarse picture is replaced at once"


def test_the_light_of_a_mix_is_shown_soon(pictures, state, renderer):
    """Lamps that were switched change nothing in the picture before the light map does."""
    rest(pictures, state)
    renderer.mixer._wanted = np.zeros((1, 3), np.float32)
    relight(renderer, 0.5)
    pictures.update(PLACE, 1.0)
    assert state.screen.statistics.resolution == (24, 16)


def rest(pictures, state):
    state.screen.clock.now_s += 1.0
    pictures.update(PLACE, 1.0)
    assert state.screen.statistics.resolution == (96, 64)
    slow_down(pictures)


def test_what_is_selected_is_outlined_until_it_is_not(pictures, state):
    assert "outline" not in pictures.images
    state.selection.choose("ball")
    pictures.update(PLACE, 1.0)
    line = pictures.images["outline"]
    alpha = alpha_of(pictures, line)
    assert alpha.shape == (64, 96) and alpha.max() > 200 and alpha[30, 48] == 0
    state.screen.clock.now_s += 1.0
    pictures.update(PLACE, 1.0)
    assert pictures.images["outline"] is line, "it rests while the picture is drawn whole"
    state.navigation.jump(replace(SIDE, name="elsewhere"))
    pictures.update(PLACE, 1.0)
    assert pictures.images["outline"] is not line
    state.selection.choose(None)
    pictures.update(PLACE, 1.0)
    assert "outline" not in pictures.images


def alpha_of(pictures, view):
    width, height, _ = view.texture.size
    data = pictures.device.queue.read_texture(
        {"texture": view.texture}, {"bytes_per_row": 4 * width}, (width, height, 1)
    )
    return np.frombuffer(data, np.uint8).reshape(height, width, 4)[..., 3]
