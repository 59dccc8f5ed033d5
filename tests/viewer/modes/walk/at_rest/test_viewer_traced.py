"""The picture at rest, and B of a comparison, traced in a process of its own and shown as frames are."""

import time
from collections import deque
from dataclasses import replace

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.running.again import bake_again, rebaked_copy
from lambent.core.light.light_mix import GroupMix, LightMix
from lambent.core.pictures.images import read_image
from lambent.core.views.camera import CameraPath
from lambent.realtime.gpu.device import open_device
from lambent.realtime.renderer import Renderer
from lambent.scenes.loaders.load import load_scene
from lambent.store.store import Store
from lambent.traced.picture import ENDED, TracedPicture
from lambent.viewer.modes.walk.at_rest.traced import FADE_S, STILL_S
from lambent.viewer.modes.walk.at_rest.tracing import MOST_SAMPLES, Wish
from lambent.viewer.modes.walk.at_rest.tracing_worker import Rooms
from lambent.viewer.modes.walk.pictures import Pictures
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.screen import Rect
from tests.baking.small_scenes import TINY
from tests.viewer.drawn_frames import LONGEST_S, drawn, until

SIZE = (48, 32)
PLACE = Rect(0, 0, *SIZE)
BLACK = {"kd": (0.0, 0.0, 0.0), "lobes": ()}


@pytest.fixture(scope="module")
def store(mi, tmp_path_factory):
    folder = tmp_path_factory.mktemp("traced") / "box.store"
    kinds = {"geometry", "environment", "light_map", "answer"}
    with bake(load_scene("builtin:box"), folder, quality=TINY, only=kinds, light_groups="scene"):
        return folder


@pytest.fixture(scope="module")
def renderer(adapter, store):
    return Renderer(open_device(), Store.open(store))


@pytest.fixture
def state(renderer, screen, store):
    state = WalkState.of(renderer.scene.record, "walk", screen, store)
    state.look.exposure_ev, state.meter.expose_wanted = 0.0, False
    state.screen.pace.adaptive = False
    return state


@pytest.fixture(scope="module")
def workers():
    """Pictures whose processes end with the module: loading one takes seconds."""
    made = []
    yield made
    for pictures in made:
        pictures.close()


@pytest.fixture
def pictures(renderer, state, workers):
    """With the process of an earlier test, if there is one."""
    made = Pictures(renderer, state)
    if workers:
        made._at_rest._tracing = workers[0]._at_rest._tracing
        made._at_rest._tracing.ask(None)
        workers[0]._state.screen.wake = lambda: state.screen.wake()
    else:
        workers.append(made)
    return made


def says_samples(state, found):
    """Whether the line on the picture at rest is right: its samples, and nothing once it is done."""
    return state.screen.at_rest == "" if found.samples >= MOST_SAMPLES else found.counted in state.screen.at_rest


def traced(pictures, state, samples=1):
    """The picture A, once it is traced with that many samples."""
    until(pictures, state, SIZE, lambda: pictures.shown[0].samples >= samples)
    return pictures.shown[0]


def b_of(pictures, state, samples):
    """The picture B, once it has that many samples."""
    until(pictures, state, SIZE, lambda: pictures.shown[-1].samples >= samples)
    return pictures.shown[1]


def reference(store, camera, samples):
    from lambent.baking.reference.path_traced import render_reference
    from lambent.store.source import scene_of

    return render_reference(scene_of(Store.open(store)), camera, *SIZE, samples, seed=5)


def tiles(values):
    return values.reshape(-1, 8, 2, 24, 3).mean(axis=(1, 3)).reshape(-1, 3)


def z_of(b, reference):
    """(8, 3) differences of B from a mean of 64 samples, in its standard errors, over tiles of 8 rows by 24 columns."""
    (mean, variance), got = reference, b.read()
    return tiles(got - mean) / np.sqrt(tiles(variance) * (1 + 64 / b.samples) / (8 * 24))


@pytest.mark.long
def test_the_picture_at_rest_is_traced_and_movement_draws_at_once(pictures, state, store):
    drawn(pictures, state, SIZE)
    a = pictures.shown[0]
    assert a is pictures._a and a.samples == 0
    found = traced(pictures, state, 32)
    mean = reference(store, state.navigation.camera, 64)[0]
    np.testing.assert_allclose(tiles(found.read()), tiles(mean), rtol=0.25, atol=0.05 * mean.mean())
    assert found.size == SIZE and says_samples(state, found)
    versions = a.version
    until(pictures, state, SIZE, lambda: found.samples >= 64)
    assert a.version == versions, "nothing is drawn meanwhile"
    state.navigation.camera = replace(state.navigation.camera, fov_y_deg=30.0)
    pictures.update(PLACE, 1.0)
    assert pictures.shown[0] is a and a.version == versions + 1 and pictures._at_rest._tracing._wish.kinds == ()
    assert state.screen.at_rest == "" and pictures.wait_s() == pytest.approx(STILL_S)
    state.screen.clock.now_s += 2 * STILL_S  # a slow frame
    assert pictures.wait_s() == 0
    again = traced(pictures, state)
    assert np.abs(tiles(again.read()) - tiles(mean)).max() > 0.1 * mean.mean(), "another view"


class OneEachFrame(deque):
    """Reports of the process, of which each frame takes one: on a busy machine several arrive between two frames."""

    taken = False

    def __bool__(self):
        self.taken = len(self) > 0 and not self.taken
        return self.taken


def test_a_coarse_picture_is_replaced_by_a_traced_one_of_half_size_first(pictures, state, monkeypatch):
    """Which is no picture to measure or save."""
    until(pictures, state, SIZE, lambda: pictures._at_rest.ready)  # before, the picture at rest is drawn whole
    monkeypatch.setattr(pictures._at_rest._tracing, "_reports", OneEachFrame())
    state.navigation.camera = replace(state.navigation.camera, fov_y_deg=39.0)
    state.screen.pace.adaptive = True
    for size in pictures._a.pacer._sizes.values():
        size.scale = 0.5
    state.comparison.mode, state.comparison.integrator = "side by side", "qmc"
    found = traced(pictures, state)
    assert found.size == (24, 16) and found.counted == "half size" and not found.rests
    assert state.comparison.figures is None and state.screen.at_rest == "traced: half size"
    pictures.save()
    assert read_image(state.screen.folder / "box-001.exr").shape == (32, 48, 3)
    until(pictures, state, SIZE, lambda: found.is_whole)
    assert found.size == SIZE and says_samples(state, found)


def test_a_picture_is_blended_in_and_a_new_exposure_needs_no_samples(pictures, state):
    traced(pictures, state)
    state.navigation.camera = replace(state.navigation.camera, fov_y_deg=42.0)
    pictures.update(PLACE, 1.0)
    before = pictures.shown[0].view
    state.screen.clock.now_s += 2 * STILL_S
    began_s, found = time.monotonic(), pictures.shown[0]
    while found.samples == 0:
        assert time.monotonic() - began_s < LONGEST_S
        pictures.update(PLACE, 1.0)  # the clock stands still
        found = pictures.shown[0]
    assert pictures.images["before A"] is before and pictures.share == 0.0 and pictures.wait_s() < FADE_S
    state.screen.clock.now_s += FADE_S / 2
    assert pictures.share == pytest.approx(0.5)
    state.screen.clock.now_s += FADE_S
    assert pictures.share == 1.0 and "before A" not in pictures.images
    number, shown = found.drawing, found.save("x") and read_image(state.screen.folder / "x-001.png")
    state.look.exposure_ev += 1
    pictures.update(PLACE, 1.0)
    assert found.drawing == number and found.samples > 0, "the same picture"
    assert found.save("y") and read_image(state.screen.folder / "y-001.png").mean() > 1.1 * shown.mean()
    np.testing.assert_allclose(read_image(state.screen.folder / "x-001.exr"), found.read(), rtol=2e-3)


def test_no_picture_of_another_exposure_is_blended(pictures, state):
    traced(pictures, state)
    state.navigation.camera = replace(state.navigation.camera, fov_y_deg=43.0)
    pictures.update(PLACE, 1.0)
    state.screen.clock.now_s += 2 * STILL_S
    began_s = time.monotonic()
    while pictures.shown[0].samples == 0:
        assert time.monotonic() - began_s < LONGEST_S
        state.look.exposure_ev += 0.01  # also in the frame in which the picture arrives
        pictures.update(PLACE, 1.0)
        assert "before A" not in pictures.images


@pytest.mark.long
def test_what_is_edited_is_traced_and_drawn_over_the_traced_picture(pictures, state):
    """A black material in place of all takes the light that they scatter."""
    found = traced(pictures, state)
    before, texture = found.read().mean(), found.texture
    name = next(iter(state.scene.materials))
    state.materials.edits.change(name, state.scene.materials[name].model_copy(update=BLACK))
    pictures.update(PLACE, 1.0)
    assert pictures.shown == (pictures._a,) and state.screen.statistics.scale == 1.0
    assert pictures._renderer._few is not texture, "it was the base"
    for name, material in state.scene.materials.items():
        state.materials.edits.change(name, material.model_copy(update=BLACK))
    assert traced(pictures, state).read().mean() < 0.7 * before


def test_the_meter_reads_the_traced_picture(pictures, state):
    found = traced(pictures, state)
    state.meter.readout_on, state.meter.cursor, state.meter.wanted = True, (0.3, 0.6), True
    drawn(pictures, state, SIZE)
    np.testing.assert_allclose(state.meter.under_cursor, pictures.shown[0].read((0.3, 0.6))[0, 0])
    assert state.meter.reading is not None and pictures.shown[0] is found


@pytest.mark.long
def test_glare_is_rated_in_traced_pictures_at_rest(pictures, state):
    """The shown picture stays meanwhile, and until one with as many samples replaces it."""
    found, glare = traced(pictures, state, 24), state.meter.glare
    drawn(pictures, state, SIZE)
    shown, glare.wanted = found.taken, True
    drawn(pictures, state, SIZE)
    assert pictures._glare.waits and pictures.wait_s() is None and glare.share is None
    until(pictures, state, SIZE, lambda: glare.found is not None)
    assert glare.made == "traced, 16 samples" and not glare.is_old and not pictures._glare.busy
    assert pictures.shown[0] is found and found.taken is shown
    until(pictures, state, SIZE, lambda: found.taken is not shown)
    assert found.samples >= shown.samples
    rated = glare.found.illuminance_lx
    state.screen.pace.traces, glare.wanted = False, True
    until(pictures, state, SIZE, lambda: not pictures._glare.busy)
    assert glare.made == "drawn" and glare.found.illuminance_lx == pytest.approx(rated, rel=0.1)
    state.navigation.camera = replace(state.navigation.camera, fov_y_deg=41.0)
    drawn(pictures, state, SIZE)
    assert glare.is_old


def test_light_that_is_mixed_while_the_picture_is_traced_lets_the_window_sleep(pictures, state):
    traced(pictures, state)
    state.lights.groups = pictures._renderer.scene.groups.records
    (group,) = (one.name for one in state.lights.groups)
    state.materials.edits.mix(LightMix({group: GroupMix(intensity=0.5)}))
    before = pictures.shown[0].read().mean()
    pictures.update(PLACE, 1.0)
    assert pictures.shown == (pictures._a,)
    assert traced(pictures, state).read().mean() == pytest.approx(0.5 * before, rel=0.1)
    mixer = pictures._renderer.mixer
    until(pictures, state, SIZE, lambda: not mixer.busy)
    assert not mixer.lags and pictures.shown[0].samples > 0
    drawn(pictures, state, SIZE)
    assert pictures.wait_s() is None
    state.materials.edits.undo()  # other tests share the renderer
    until(pictures, state, SIZE, lambda: not (mixer.lags or mixer.busy))


@pytest.mark.parametrize("how", [{"near_m": 1.0}, {"show": "light-map"}, {"lookup": "light_field-choice"}])
def test_what_paths_do_not_show_stays_drawn(pictures, state, how):
    for name, value in how.items():
        setattr(state.look, name, value)
    drawn(pictures, state, SIZE, 3)
    assert pictures.shown == (pictures._a,) and not pictures._at_rest.coming and pictures._a.rests


def test_turned_off_the_picture_at_rest_is_drawn(pictures, state):
    traced(pictures, state)
    state.screen.pace.traces = False
    drawn(pictures, state, SIZE, 3)
    assert pictures.shown == (pictures._a,) and state.screen.at_rest == ""
    until(pictures, state, SIZE, lambda: pictures.wait_s() is None)  # light may still be mixed


@pytest.mark.long
def test_b_is_the_path_traced_scene_beside_the_picture_at_rest(pictures, state, store):
    """Against the reference by z; at rest only, and A stands in until there is something."""
    state.comparison.mode, state.comparison.integrator = "side by side", "path"
    state.navigation.camera = replace(state.navigation.camera, fov_y_deg=50.0)
    pictures.update(PLACE, 1.0)
    a, views = pictures.shown[0], pictures.views
    assert views[0] is a.view and views[1] is not a.view and views[1].texture is a.view.texture
    b = b_of(pictures, state, 16)
    assert np.abs(z_of(b, reference(store, state.navigation.camera, 64))).max() < 4
    until(pictures, state, SIZE, lambda: state.comparison.figures is not None and min(state.comparison.figures.of) >= 4)
    assert state.comparison.divider.a_label.startswith("traced") and "path traced" in state.comparison.divider.b_label
    assert state.comparison.figures.psnr_db > 20
    state.look.show = "specular"
    drawn(pictures, state, SIZE)
    assert "all light" in state.comparison.fault and len(pictures.shown) == 1


def test_beside_a_traced_b_the_picture_a_is_drawn(pictures, state):
    state.comparison.mode = "side by side"
    b = b_of(pictures, state, 4)
    assert pictures.shown[0] is pictures._a and b.drawing[0] == "traced"
    until(pictures, state, SIZE, lambda: state.comparison.figures is not None)
    assert state.comparison.figures.of[0] == 0 < state.comparison.figures.of[1]


@pytest.mark.long
def test_light_follows_edits_as_baked_estimated_or_rebaked(renderer, store, state):
    """In the diffuse light and the lamp's, which drawing shows as well, in other materials than the store's."""
    red = {name: one.model_copy(update={"kd": (0.7, 0.1, 0.1)}) for name, one in state.scene.materials.items()}
    bake_again(store, rebaked_copy(store), red, quality=TINY).close()
    state.look.show, camera = "diffuse", state.navigation.camera
    frame = state.look.frame(camera, SIZE, red)
    truth = Renderer(renderer.device, Store.open(rebaked_copy(store))).still_radiance(frame, 16)
    rooms, found = Rooms(store, 0.0, ()), []
    for how in ({"rebaked": True}, {}, {"answers": False}):
        wish = Wish(1, ("traced",), materials=red, **how)
        picture = TracedPicture(rooms.of("traced", wish).tracer, camera, SIZE, part="diffuse")
        while picture.samples < ENDED:
            picture.sample()
        found.append(picture.mean())
    exact, estimated, as_baked, truth = (tiles(one) for one in (*found, truth))
    np.testing.assert_allclose(exact, truth, rtol=0.1, atol=0.02 * truth.mean())
    estimated, as_baked, truth = (one[2:] for one in (estimated, as_baked, truth))  # the walls, below the lamp
    assert np.abs(estimated - truth).mean() < 0.1 * truth.mean()
    assert np.abs(as_baked - truth).mean() > 0.15 * truth.mean(), "the light of the store's own materials"


@pytest.mark.long
def test_a_film_is_traced_frame_by_frame(pictures, state, tmp_path):
    camera = state.navigation.camera
    state.films.file_name, state.films.size, state.films.quality = "a-##.exr", "640 x 360", "traced, 16 samples"
    until(pictures, state, SIZE, lambda: pictures._at_rest._tracing.ready)
    state.films.wanted = CameraPath(name="short", keys=(camera, replace(camera, fov_y_deg=30.0)), seconds=0.04)
    drawn(pictures, state, SIZE)
    assert state.films.under_way.waits and pictures.wait_s() is None, "the process wakes the window"
    until(pictures, state, SIZE, lambda: state.films.under_way is None)
    assert "2 frames" in state.screen.messages[-1].text
    first, last = (read_image(tmp_path / f"a-0{number}.exr") for number in (1, 2))
    assert first.shape == (360, 640, 3) and np.abs(first - last).mean() > 0.02 * first.mean()


@pytest.mark.long
def test_the_end_of_the_process_is_a_line_and_the_picture_is_drawn(pictures, state, workers):
    """Last, because it ends the process of the tests before."""
    traced(pictures, state)
    pictures._at_rest._tracing._process._process.kill()
    began_s = time.monotonic()
    while not pictures._at_rest.fault and time.monotonic() - began_s < LONGEST_S:
        drawn(pictures, state, SIZE)
    assert "tracing was killed" in pictures._at_rest.fault
    state.navigation.camera = replace(state.navigation.camera, fov_y_deg=33.0)
    drawn(pictures, state, SIZE, 3)
    assert pictures.shown == (pictures._a,) and pictures.wait_s() is None and pictures._a.rests
    assert sum("not traced at rest" in message.text for message in state.screen.messages) == 1
