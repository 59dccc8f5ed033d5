"""What the walk window draws besides the picture, on a real adapter, without a window."""

import errno
from dataclasses import replace

import numpy as np
import pytest

from lambent.core.light.false_colour import Range, false_colour
from lambent.core.light.photometry import photometric
from lambent.core.pictures.images import read_encoded, read_image
from lambent.core.views.camera import CameraPath
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import open_device
from lambent.realtime.renderer import Renderer
from lambent.store.store import Store
from lambent.viewer.modes.walk.pictures import Pictures
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.screen import Rect
from tests.viewer.drawn_frames import drawn
from tests.viewer.small_store import FRONT, SIDE, write_small_store

SIZE = (96, 64)
PLACE = Rect(0, 0, *SIZE)


@pytest.fixture(scope="module")
def renderer(adapter, tmp_path_factory):
    return Renderer(open_device(), Store.open(write_small_store(tmp_path_factory.mktemp("pictures") / "small")))


@pytest.fixture
def state(renderer, screen):
    screen.pace.adaptive = False
    return WalkState.of(renderer.scene.record, "walk", screen)


def test_false_colour_of_the_shader_is_that_of_numpy(renderer):
    frame = FrameState(FRONT, 96, 64, view_transform="false-colour", scale=Range(5, 300))
    expected = false_colour(photometric(renderer.image(frame)), frame.scale)
    np.testing.assert_allclose(renderer.display_image(frame) / 255, expected, atol=0.02)


def test_the_light_map_shows_irradiance(renderer):
    irradiance = renderer.image(FrameState(FRONT, 96, 64, show="light-map"))
    np.testing.assert_allclose(irradiance[-1], 2.0, rtol=1e-3)
    assert irradiance[0].max() == 0, "the sky has none"


def test_the_noise_of_the_light_map_is_shown_in_percent(renderer):
    noisy = Renderer(renderer.device, replace(renderer.scene, noise=np.full((4, 4), 0.125, np.float32)))
    frame = FrameState(FRONT, 96, 64, show="noise", scale=Range(1, 100))
    np.testing.assert_allclose(noisy.image(frame)[-1], 0.125, rtol=1e-3)
    expected = false_colour(np.array(12.5), frame.scale)
    shown = noisy.display_image(frame) / 255
    np.testing.assert_allclose(shown[-1], np.tile(expected, (96, 1)), atol=0.01)
    assert shown[0].max() == 0, "the sky has none"
    assert renderer.image(frame).max() == 0, "a store without it shows black"


def test_noise_has_a_range_of_its_own(renderer, state):
    noisy = replace(renderer.scene, noise=np.full((4, 4), 0.125, np.float32))
    pictures = Pictures(Renderer(renderer.device, noisy), state)
    state.look.show, state.meter.wanted = "noise", True
    drawn(pictures, state, SIZE)
    before = state.look.scale
    assert state.meter.reading.log_mean == pytest.approx(12.5, rel=1e-3), "black is left out"
    state.look.noise_scale, state.meter.fit_wanted, state.meter.expose_wanted = Range(1, 2), True, True
    exposure_ev = state.look.exposure_ev
    drawn(pictures, state, SIZE)
    assert state.look.noise_scale == state.meter.reading.ranges[0] and state.look.scale == before
    assert state.look.exposure_ev == exposure_ev, "noise sets no exposure"
    state.look.show, state.look.view_transform = "full", "false-colour"
    drawn(pictures, state, SIZE)
    assert state.look.scale == state.meter.reading.ranges[0] != before, "that of light is fitted when it is first shown"


def test_near_things_are_cut_away(renderer):
    whole, cut = (renderer.image(FrameState(FRONT, 96, 64, near_m=near)) for near in (None, 4.0))
    assert np.abs(whole[32, 48] - cut[32, 48]).max() > 0.05, "the ball at three metres is gone"
    np.testing.assert_allclose(whole[:8], cut[:8], atol=1e-3)


def test_the_meter_sets_the_exposure(renderer, state):
    pictures = Pictures(renderer, state)
    drawn(pictures, state, SIZE)
    assert state.meter.reading is None, "nobody looks at it"
    state.meter.expose_wanted = True
    drawn(pictures, state, SIZE)
    assert state.look.exposure_ev == pytest.approx(state.meter.reading.exposure_ev)
    state.look.view_transform = "false-colour"
    drawn(pictures, state, SIZE)
    assert state.look.scale == state.meter.reading.ranges[0] and not state.meter.fit_wanted


def test_long_frames_at_rest_wait_while_somebody_works(renderer, state):
    state.screen.pace.adaptive = True
    pictures = Pictures(renderer, state)
    pictures._a._whole_s, pictures._a.pacer._sizes[True].scale = 0.45, 0.5
    drawn(pictures, state, SIZE, dt_s=1.0)
    state.screen.pace.touched_s = state.screen.clock.now_s
    drawn(pictures, state, SIZE, 2, dt_s=0.2)
    assert pictures._a.version == 1 and state.screen.statistics.scale == 0.5
    assert pictures.wait_s() == pytest.approx(0.05)
    state.navigation.camera = SIDE
    drawn(pictures, state, SIZE)
    assert pictures._a.version == 2, "motion is drawn at once"
    drawn(pictures, state, SIZE)
    assert pictures._a.version == 3 and state.screen.statistics.scale == 1.0 and pictures.wait_s() is None


def test_what_is_under_the_cursor(renderer, state):
    pictures = Pictures(renderer, state)
    state.meter.readout_on = True
    state.look.show, state.meter.cursor = "light-map", (0.1, 0.95)
    drawn(pictures, state, SIZE)
    assert state.meter.under_cursor == pytest.approx((2, 2, 2), rel=1e-3)
    state.meter.cursor = (0.5, 0.01)
    drawn(pictures, state, SIZE)
    assert state.meter.under_cursor == (0, 0, 0)
    state.meter.cursor = None
    drawn(pictures, state, SIZE)
    assert state.meter.under_cursor is None


def test_side_by_side_with_another_integrator(renderer, state):
    pictures = Pictures(renderer, state)
    state.comparison.mode, state.comparison.integrator = "side by side", "qmc"
    drawn(pictures, state, SIZE, 3)
    figures = state.comparison.figures
    assert len(pictures.views) == 2 and figures.of == (0, 0)
    assert 20 < figures.psnr_db < 80
    assert state.comparison.divider.a_label == "lamps" and "qmc" in state.comparison.divider.b_label
    state.navigation.camera = SIDE
    drawn(pictures, state, SIZE, dt_s=0.01)
    assert state.comparison.figures.psnr_db != figures.psnr_db, "figures of another place are not shown"
    state.comparison.mode = "off"
    drawn(pictures, state, SIZE)
    assert len(pictures.views) == 1


def test_an_integrator_agrees_with_itself(renderer, state):
    pictures = Pictures(renderer, state)
    state.comparison.mode, state.comparison.integrator = "error map", "lamps"
    drawn(pictures, state, SIZE, 4)
    assert state.comparison.figures.psnr_db == np.inf and state.comparison.figures.difference_percent == 0
    assert (pictures.images["picture A"][..., :3] == 0).all()
    pictures.save()
    names = sorted(p.name for p in state.screen.folder.iterdir())
    assert names == ["small-room-001-error.png", "small-room-001.exr", "small-room-001.png"]


def film(pictures, state, name):
    state.films.file_name, state.films.size = name, "640 x 360"
    state.films.wanted = CameraPath(name="short", keys=(FRONT, SIDE), seconds=0.1)
    drawn(pictures, state, SIZE)


@pytest.mark.long
def test_films_and_rows_of_pictures(renderer, state, tmp_path):
    pictures = Pictures(renderer, state)
    for name in ("a.mp4", "b-##.png", "c.exr"):
        film(pictures, state, name)
        for _ in range(100):
            if state.films.under_way is None:
                break
            drawn(pictures, state, SIZE)
        assert "3 frames" in state.screen.messages[-1].text
    names = ["a.mp4", "b-01.png", "b-02.png", "b-03.png", "c-0001.exr", "c-0002.exr", "c-0003.exr"]
    assert sorted(p.name for p in tmp_path.iterdir()) == names
    assert read_encoded(tmp_path / "b-01.png").shape == read_image(tmp_path / "c-0001.exr").shape == (360, 640, 3)


def test_a_film_can_be_cancelled_and_leaves_nothing(renderer, state, tmp_path):
    pictures = Pictures(renderer, state)
    film(pictures, state, "a.mp4")
    assert not state.films.under_way.over and list(tmp_path.iterdir())
    state.screen.pace.answering = True
    done = state.films.under_way.done
    drawn(pictures, state, SIZE)
    assert state.films.under_way.done == done, "events come first"
    state.films.under_way.cancel()
    state.films.under_way = None
    assert list(tmp_path.iterdir()) == []


def test_a_film_that_cannot_be_is_said(renderer, state, tmp_path):
    pictures = Pictures(renderer, state)
    film(pictures, state, "no/such.mp4")
    assert "no film: " in state.screen.messages[-1].text and state.films.under_way is None
    film(pictures, state, "b.png")
    (tmp_path / "b-0001.png").unlink(missing_ok=True)
    (tmp_path / "b-0002.png").mkdir()
    (tmp_path / "b-0001.png").mkdir()
    (tmp_path / "b-0003.png").mkdir()
    for _ in range(5):
        drawn(pictures, state, SIZE)
    assert state.films.under_way is None and "is a folder" in state.screen.messages[-1].text


def test_a_folder_that_takes_no_files_is_said(renderer, state, monkeypatch):
    """As root every folder takes files: the system's refusal is put in its place."""

    def refused(*_, **__):
        raise PermissionError(errno.EACCES, "Permission denied")

    pictures = Pictures(renderer, state)
    drawn(pictures, state, SIZE)
    monkeypatch.setattr("tempfile.TemporaryFile", refused)
    monkeypatch.setattr("os.open", refused)
    pictures.save()
    said = state.screen.messages
    assert "picture not saved: " in said[-1].text and "Permission denied" in said[-1].text
    for name in ("a.mp4", "a-##.png"):
        film(pictures, state, name)
        assert "no film: " in said[-1].text and "Permission denied" in said[-1].text
        assert state.films.under_way is None
    monkeypatch.setattr(
        "lambent.viewer.modes.walk.views.filming.check_place", lambda path: None
    )  # and is refused later
    film(pictures, state, "b.mp4")
    assert "no film: " in state.screen.messages[-1].text and state.films.under_way is None
