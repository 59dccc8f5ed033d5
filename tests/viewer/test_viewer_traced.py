"""Path tracing as B of a comparison: asked for at rest, in a process of its own, shown as frames are."""

import time
from dataclasses import replace

import numpy as np
import pytest

from lambent.bake.bake import bake
from lambent.realtime.device import open_device
from lambent.realtime.renderer import Renderer
from lambent.scenes import load_scene
from lambent.store.store import Store
from lambent.viewer.modes.walk.comparison import TRACED
from lambent.viewer.modes.walk.pictures import Pictures
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.modes.walk.tracing import Wish
from lambent.viewer.modes.walk.tracing_worker import Wishes
from lambent.viewer.work import POLL_S
from tests.bake.small_scenes import TINY
from tests.viewer.drawn_frames import drawn
from tests.viewer.small_store import FRONT, MATERIALS, SIDE

SIZE = (48, 32)
LONGEST_S = 180.0  # for a picture: libraries are loaded and kernels compiled first


@pytest.fixture(scope="module")
def store(mi, tmp_path_factory):
    folder = tmp_path_factory.mktemp("traced") / "box.store"
    with bake(load_scene("builtin:box"), folder, quality=TINY, only={"geometry", "environment"}):
        return folder


@pytest.fixture(scope="module")
def renderer(adapter, store):
    return Renderer(open_device(), Store.open(store))


@pytest.fixture
def state(renderer, screen, store):
    state = WalkState.of(renderer.scene.record, "walk", screen, store)
    state.comparison.mode, state.comparison.integrator = "side by side", TRACED
    return state


@pytest.fixture
def pictures(renderer, state):
    made = Pictures(renderer, state)
    yield made
    made.close()


def traced_until(pictures, state, samples):
    """The picture B once it has that many samples."""
    began_s = time.monotonic()
    while time.monotonic() - began_s < LONGEST_S:
        drawn(pictures, state, SIZE)
        assert not state.comparison.fault
        b = pictures.shown[1]
        if b.samples >= samples:
            return b
        time.sleep(POLL_S)
    raise AssertionError(f"no picture of {samples} samples: {b.label}")


def reference(store, camera, samples):
    from lambent.bake.reference.path_traced import render_reference
    from lambent.store.source import scene_of

    return render_reference(scene_of(Store.open(store)), camera, *SIZE, samples, seed=5)


def z_of(b, reference):
    """(8, 3) differences of B from a mean of 64 samples, in its standard errors, over tiles of 8 rows by 24 columns."""
    (mean, variance), got = reference, b.read()

    def tiles(values):
        return values.reshape(-1, 8, 2, 24, 3).mean(axis=(1, 3)).reshape(-1, 3)

    return tiles(got - mean) / np.sqrt(tiles(variance) * (1 + 64 / b.samples) / (8 * 24))


def test_b_is_the_path_traced_scene_and_follows_the_camera(pictures, state, store):
    """Against the reference by z; at rest only, and A stands in until there is something."""
    drawn(pictures, state, SIZE)
    a, b = pictures.shown
    views = pictures.views
    assert views[0] is a.view and views[1] is not a.view and views[1].texture is a.view.texture and "at rest" in b.label
    b = traced_until(pictures, state, 8)
    first = reference(store, state.navigation.camera, 64)
    assert np.abs(z_of(b, first)).max() < 4
    assert (
        pictures.views[1].texture is not a.view.texture and f"{b.samples} samples" in state.comparison.divider.b_label
    )
    camera = state.navigation.camera
    state.navigation.camera = replace(camera, fov_y_deg=0.6 * camera.fov_y_deg)
    drawn(pictures, state, SIZE)
    assert pictures.views[1].texture is a.view.texture and not b.readable, "the last view is not this one"
    b = traced_until(pictures, state, 16)
    assert np.abs(z_of(b, reference(store, state.navigation.camera, 64))).max() < 4
    assert np.abs(z_of(b, first)).max() > 8, "the first view is another one"
    for _ in range(4):
        drawn(pictures, state, SIZE)
    assert state.comparison.figures is not None and state.comparison.figures.of >= 4


def test_edited_materials_are_traced_and_exposure_needs_no_new_paths(pictures, state):
    """A black material in place of all takes the light that they scatter."""
    b = traced_until(pictures, state, 4)
    before = b.read().mean()
    process = b._tracing._process._process
    state.look.exposure_ev += 1
    count = b.samples
    drawn(pictures, state, SIZE)
    assert b.samples >= count
    for name, material in state.scene.materials.items():
        state.materials.edits.change(name, material.model_copy(update={"kd": (0.0, 0.0, 0.0), "lobes": ()}))
    after = traced_until(pictures, state, 4).read().mean()
    assert after < 0.7 * before, (after, before)
    state.comparison.mode = "off"
    drawn(pictures, state, SIZE)
    assert not b._tracing.busy, "nobody looks"
    assert process.poll() is None
    pictures.close()
    assert process.poll() is not None


def test_what_cannot_be_traced_is_said(pictures, state, tmp_path):
    state.look.show = "specular"
    drawn(pictures, state, SIZE)
    assert "all light" in state.comparison.fault
    state.look.show, state.store = "full", None
    other = Pictures(pictures._renderer, state)
    drawn(other, state, SIZE)
    assert "no scene file" in state.comparison.fault and len(other.shown) == 1


def test_a_store_without_a_scene_is_a_line(renderer, state, tmp_path):
    from tests.viewer.small_store import write_small_store

    state.store = write_small_store(tmp_path / "small.store")
    pictures, began_s = Pictures(renderer, state), time.monotonic()
    while not state.comparison.fault and time.monotonic() - began_s < LONGEST_S:
        drawn(pictures, state, SIZE)
        time.sleep(POLL_S)
    assert "no path of its scene file" in state.comparison.fault and "\n" not in state.comparison.fault
    pictures.close()


def test_wishes_keep_what_they_say_and_the_newest_stands():
    wish = Wish(3, FRONT, (5, 7), MATERIALS)
    assert Wish.of(wish.said()) == wish and Wish.of(Wish(4).said()) == Wish(4)
    wishes = Wishes(iter([]))
    assert wishes.newest(None) is None, "the stream has ended"

    import json
    import queue

    lines = queue.Queue()
    wishes = Wishes(iter(lines.get, None))
    first = Wish(1, FRONT)
    lines.put(json.dumps(first.said()).encode())
    read = wishes.newest(None)
    assert read == first and wishes.stands(read)
    lines.put(json.dumps(Wish(2, SIDE).said()).encode())
    second = wishes.newest(read)
    assert second.number == 2 and not wishes.stands(read)
    lines.put(None)
    assert wishes.newest(second) is None


def test_given_radiance_is_shown_as_frames_show_theirs(renderer, state):
    """The same picture to a step of 8 bits, under every view transform."""
    given = renderer.given()
    for view in ("filmic", "neutral", "linear", "false-colour"):
        frame = replace(
            state.look.frame(state.navigation.camera, SIZE, {}), view_transform=view, antialias=False, exposure_ev=-1.0
        )
        given.take(renderer.image(frame))
        given.show(frame)
        data = renderer.device.queue.read_texture(
            {"texture": given.view.texture}, {"bytes_per_row": 4 * SIZE[0]}, (*SIZE, 1)
        )
        shown = np.frombuffer(data, np.uint8).reshape(SIZE[1], SIZE[0], 4)[..., :3].astype(int)
        assert np.abs(shown - renderer.display_image(frame)).max() <= 1
    assert shown.std() > 3
