"""A film under way: what its frames show, how long it still takes, and how it ends."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.views.camera import Camera, CameraPath
from lambent.realtime.frame_state import FrameState
from lambent.viewer.modes.walk.views import filming
from lambent.viewer.modes.walk.views.filming import LONGEST_FRAMES, Filming
from tests.viewer.conftest import Clock

PIXELS = np.zeros((4, 6, 3), np.uint8)
START, END = (Camera(f"at {x:g} m", (x, 1.0, 0.0), (x, 1.0, 9.0)) for x in (0.0, 4.0))
PATH = CameraPath("walk", (START, END), 2.0)
STATE = FrameState(START, 6, 4)


@pytest.fixture
def clock(monkeypatch):
    """Time goes on by a second for each frame."""
    found = Clock()
    monkeypatch.setattr(filming, "time", SimpleNamespace(monotonic=found))
    return found


@pytest.fixture
def drawn(clock):
    """A renderer, and the frames that it drew."""
    views = []

    def draw(view):
        clock.now_s += 1
        views.append(view)
        return PIXELS

    return SimpleNamespace(display_image=draw, views=views)


def test_frames_have_the_camera_and_the_light_of_their_time(drawn, tmp_path):
    film = Filming(drawn, tmp_path / "f-#.png", PATH, STATE, 4, light=lambda time_s: {"lamp": (time_s, 0.0, 0.0)})
    while not film.step():
        pass
    assert film.error is None and film.done == film.total == 8
    assert [view.light["lamp"][0] for view in drawn.views] == [0.25 * k for k in range(8)]
    assert [view.camera.position[0] for view in drawn.views] == pytest.approx([0.5 * k for k in range(8)])
    assert len(list(tmp_path.glob("f-*.png"))) == 8


def test_the_time_left_is_that_of_the_frames_so_far(drawn, tmp_path):
    film = Filming(drawn, tmp_path / "f-#.png", PATH, STATE, 4)
    assert film.left_s is None
    for k in range(1, 4):
        film.step()
        assert (film.done, film.left_s) == (k, 8.0 - k)
    film.cancel()
    assert film.over and len(list(tmp_path.glob("f-*.png"))) == 3, "images stay"


def test_a_film_waits_for_frames_that_are_traced(drawn, tmp_path):
    asked = []
    traced = SimpleNamespace(ask=asked.append, radiance=None, display=lambda light, view: light)
    film = Filming(drawn, tmp_path / "f-#.png", PATH, STATE, 4, traced)
    assert not film.step() and film.waits and (film.done, len(asked)) == (0, 1)
    assert not film.step() and film.waits and len(asked) == 1
    traced.radiance = PIXELS
    while not film.step():
        pass
    assert film.done == len(asked) == 8 and not drawn.views


def test_films_that_are_too_long_and_files_that_cannot_be_written(drawn, tmp_path):
    longest = CameraPath("long", (START, END), LONGEST_FRAMES / 4)
    assert Filming(drawn, tmp_path / "f-#.png", longest, STATE, 4).total == LONGEST_FRAMES
    with pytest.raises(UserError, match="film is too long"):
        Filming(drawn, tmp_path / "f-#.png", replace(longest, seconds=LONGEST_FRAMES / 4 + 0.25), STATE, 4)
    (tmp_path / "file").write_text("")
    lost = Filming(drawn, tmp_path / "file" / "f-#.png", PATH, STATE, 4)
    assert lost.step() and lost.over and "file" in lost.error
