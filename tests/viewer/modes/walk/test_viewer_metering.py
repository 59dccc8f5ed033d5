"""The meter, the comparison and the marks: numbers that can be worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.light.exposure import KEY
from lambent.core.light.photometry import LM_PER_W
from lambent.core.pictures.metrics import flip_error
from lambent.core.progress import Cancelled, silent
from lambent.core.views.camera import Camera
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.baked import Probe
from lambent.viewer.modes.walk.comparison import Comparison, _shrunk, difference, flip_in_process
from lambent.viewer.modes.walk.light.glare import GlareDrawing, GlareMeter
from lambent.viewer.modes.walk.light.metering import read
from lambent.viewer.modes.walk.markers import Marks, mirror_ball, outline, projected
from lambent.viewer.modes.walk.views.filming import film_file

CAMERA = Camera(name="c", position=(0, 1, 5), target=(0, 1, 0), fov_y_deg=90)


def test_a_reading_by_hand():
    picture = np.ones((40, 60, 3), np.float32)
    picture[:20] = 0.01
    reading = read(picture)
    assert reading.mean == pytest.approx(LM_PER_W * 0.505, rel=1e-5)
    assert reading.log_mean == pytest.approx(LM_PER_W * 0.1, rel=1e-5)
    assert reading.exposure_ev == pytest.approx(np.log2(KEY / 0.1), abs=0.03)
    assert reading.counts.sum() == 2400 and np.count_nonzero(reading.counts) == 2
    brightest = np.flatnonzero(reading.counts)[-1]
    assert reading.edges[brightest] <= LM_PER_W <= reading.edges[brightest + 1]


def test_black_and_broken_pictures():
    assert read(np.zeros((8, 8, 3))) is None
    picture = np.full((8, 8, 3), 2.0)
    picture[0, 0] = np.nan
    picture[1, 1] = 0
    assert read(picture).log_mean == pytest.approx(2 * LM_PER_W)
    assert read(picture).mean == pytest.approx(2 * LM_PER_W * 62 / 63), "black counts in the mean, nothing else does"
    assert abs(read(np.full((8, 8, 3), 1e-9)).exposure_ev) == 12


def test_the_difference_is_relative_to_b():
    b = np.full((4, 4, 3), 2.0)
    np.testing.assert_allclose(difference(1.1 * b, b), 10, rtol=1e-6)
    b[0, 0] = 0.0
    assert np.isfinite(difference(b + 0.1, b)).all()


def test_flip_of_another_process_is_the_same():
    a, b = np.random.default_rng(3).random((2, 40, 50, 3)).astype(np.float32)
    np.testing.assert_allclose(flip_in_process(a, b, silent), flip_error(a, b), atol=1e-6)


def test_flip_can_be_cancelled():
    def stop(done, total, what):
        raise Cancelled

    with pytest.raises(Cancelled):
        flip_in_process(np.zeros((64, 64, 3)), np.zeros((64, 64, 3)), stop)


def test_large_pictures_are_compared_by_means_of_squares():
    blocks = np.random.default_rng(2).random((3, 5, 3))
    picture = np.pad(blocks.repeat(2, axis=0).repeat(2, axis=1), ((0, 1), (0, 0), (0, 0)))
    np.testing.assert_allclose(_shrunk(picture, 2), blocks)


def test_figures_and_maps():
    comparison = Comparison()
    comparison.mode = "error map"
    b = np.random.default_rng(5).random((32, 32, 3)).astype(np.float32)
    assert comparison.due("here", (0, 8))
    comparison.compare(1.2 * b, b, "linear", 0.0, (0, 8))
    assert not comparison.due("here", (0, 15)) and comparison.due("here", (0, 16))
    assert comparison.due("here", (1, 8)), "the slower picture counts as well"
    comparison._work.wait()
    comparison.tick()
    figures = comparison.figures
    assert figures.of == figures.flip_of == (0, 8) and figures.difference_percent > 5
    assert 10 < figures.psnr_db < 40 and 0 < figures.flip_mean < 1
    by_difference = comparison.map
    assert by_difference.shape == (32, 32, 4) and (by_difference[..., 3] == 255).all()
    comparison.kind = "FLIP"
    comparison.tick()
    assert comparison.map.shape == (32, 32, 4) and (comparison.map != by_difference).any()
    assert comparison.due("elsewhere", (0, 1)) and comparison.map is None


def test_places_on_the_screen():
    places, depths = projected(CAMERA, np.array([[0, 1, 0], [5, 1, 0], [0, 6, 0], [0, 1, 9.0]]), (200, 100))
    np.testing.assert_allclose(places[:3], [[0.5, 0.5], [0.75, 0.5], [0.5, 0.0]], atol=1e-9)
    np.testing.assert_allclose(depths, [5, 5, 5, -4])


def test_outlines_are_cut_at_the_eye():
    floor = np.array([[-1, 0, 9], [1, 0, 9], [1, 0, 0], [-1, 0, 0.0]])
    line = outline(floor, CAMERA, (100, 100))
    assert len(line) == 4 and np.isfinite(line).all()
    assert max(y for _, y in line) > 1, "it reaches below the picture"
    assert outline(floor + np.array([0, 0, 20]), CAMERA, (100, 100)) is None


def test_a_mirror_ball_shows_what_is_behind_the_viewer_in_its_middle():
    cube = np.zeros((6, 8, 8, 3), np.float32)
    cube[4, ..., 0] = 5  # +z: where the camera stands
    cube[0, ..., 1] = 5  # +x: to the right
    ball = mirror_ball(cube, CAMERA, (0, 1, 0), 41, "linear", 0.0)
    assert ball[20, 20, 0] == 255 and ball[20, 20, 1] == 0
    assert ball[20, 34, 1] == 255 and ball[20, 6, 1] == 0
    assert ball[0, 0, 3] == 0 and ball[20, 20, 3] == 255


def test_balls_of_probes():
    probes = {"lamp": Probe((0, 1, 0), np.ones((6, 4, 4, 3))), "gone": Probe((0, 1, 9), np.ones((6, 4, 4, 3)))}
    marks = Marks(probes, ())
    marks.probes = True
    marks.update(CAMERA, (900, 600), "filmic", 0.0)
    (ball,) = marks.balls
    assert (ball.name, ball.x, ball.y) == ("lamp", 0.5, 0.5)
    assert set(marks.images) == {"probe lamp"} and marks.images["probe lamp"].shape[2] == 4
    before = marks.images["probe lamp"]
    marks.update(CAMERA, (900, 600), "filmic", 0.0)
    assert marks.images["probe lamp"] is before
    marks.probes = False
    marks.update(CAMERA, (900, 600), "filmic", 0.0)
    assert marks.balls == () and marks.images == {}


@pytest.mark.parametrize(
    "name", ["", "tour", ".mp4", "tour.avi", "no/such/tour.mp4", "a#b#.png", "folder.mp4", "a\n.mp4"]
)
def test_names_of_films_that_are_none(tmp_path, name):
    (tmp_path / "folder.mp4").mkdir()
    with pytest.raises(UserError):
        film_file(tmp_path, name)


def test_names_of_films(tmp_path):
    for name in ("tour.mp4", "t.MP4", "tour-####.png", "tour.exr"):
        assert film_file(tmp_path, f" {name} ") == tmp_path / name


def test_a_film_replaces_no_file_of_others(tmp_path):
    for name, asked in (("tour.mp4", "tour.mp4"), ("tour-0007.png", "tour-####.png")):
        (tmp_path / name).write_text("mine")
        with pytest.raises(UserError, match=f"{name}: exists already"):
            film_file(tmp_path, asked)


class Bright:
    """A renderer of a world that is 1000 cd/m2 everywhere."""

    def still_radiance(self, state, supersamples):
        assert state.show == "full" and state.width == state.height
        self.drawn = [*getattr(self, "drawn", []), state.camera]
        return np.full((state.height, state.width, 3), 1000 / LM_PER_W, np.float32)


class Traced:
    """Faces that are half as bright, traced one after the other until the process ends."""

    def __init__(self, faces):
        self._left, self.asked, self._radiance = faces, [], None

    def ask(self, frame):
        self.asked.append(frame.camera)
        self._radiance = np.full((frame.height, frame.width, 3), 500 / LM_PER_W, np.float32)

    @property
    def radiance(self):
        if self._left == 0:
            raise UserError("the process ended")
        self._left, found, self._radiance = self._left - (self._radiance is not None), self._radiance, None
        return found


def rated(drawing, meter, renderer, traced=None):
    """Steps until the glare is rated."""
    steps, frame = 0, FrameState(CAMERA, 320, 200, show="diffuse")
    while drawing.busy:
        drawing.step(frame, lambda: renderer, lambda _: traced)
        steps += 1
        assert (meter.share is None) == (not drawing.busy) and steps < 12
    return steps


@pytest.mark.long
def test_glare_is_drawn_face_by_face():
    meter, renderer = GlareMeter(wanted=True), Bright()
    drawing, frame = GlareDrawing(meter), FrameState(CAMERA, 320, 200)
    assert rated(drawing, meter, renderer) == 5 == len(renderer.drawn)  # what is behind the eye is not drawn
    assert meter.found.illuminance_lx == pytest.approx(1000 * np.pi, rel=5e-3) and meter.made == "drawn"
    assert meter.found.sources == () and not meter.is_old
    drawing.step(frame, lambda: renderer, lambda _: None)
    assert len(renderer.drawn) == 5
    drawing.step(replace(frame, light={"lamp": (0.0, 0.0, 0.0)}), lambda: renderer, lambda _: None)
    assert meter.is_old, "of another state"
    meter.wanted = True
    for _ in range(2):
        drawing.step(frame, lambda: renderer, lambda _: None)
    meter.wanted = True  # again, before it is done
    drawing.step(frame, lambda: renderer, lambda _: None)
    assert meter.share == pytest.approx(1 / 5)


@pytest.mark.long
def test_glare_is_traced_or_drawn_but_not_mixed():
    meter, renderer, traced = GlareMeter(wanted=True), Bright(), Traced(9)
    drawing = GlareDrawing(meter)
    assert rated(drawing, meter, renderer, traced) == 5 == len(set(traced.asked))
    assert meter.found.illuminance_lx == pytest.approx(500 * np.pi, rel=5e-3) and "traced" in meter.made
    meter.wanted = True
    assert rated(drawing, meter, renderer, Traced(3)) == 3 + 1 + 5 == 4 + len(renderer.drawn)
    assert meter.found.illuminance_lx == pytest.approx(1000 * np.pi, rel=5e-3) and meter.made == "drawn"
