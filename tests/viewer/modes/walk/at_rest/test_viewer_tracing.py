"""The process that traces: its requests, when it sends a picture, and what it cannot trace."""

import itertools
import json
import queue
import time
from pathlib import Path

import numpy as np
import pytest

from lambent.realtime.gpu.device import open_device
from lambent.realtime.renderer import Renderer
from lambent.scenes.scene import ImageTexture
from lambent.store.store import Store
from lambent.viewer.background.work import POLL_S
from lambent.viewer.modes.walk.at_rest.tracing import Tracing, Wish
from lambent.viewer.modes.walk.at_rest.tracing_worker import GROWTH, PICTURE_S, Converging, Wishes
from lambent.viewer.modes.walk.pictures import Pictures
from lambent.viewer.modes.walk.state import WalkState
from tests.viewer.drawn_frames import drawn
from tests.viewer.dying_worker import HEIGHT, WIDTH
from tests.viewer.small_store import FRONT, MATERIALS, SIDE, write_small_store
from tests.viewer.window_session import ROOT

SIZE = (48, 32)
LONGEST_S = 60.0


def test_wishes_keep_what_they_say_and_the_newest_stands():
    wish = Wish(
        3, ("traced", "path"), FRONT, (5, 7), MATERIALS, {"brass": ImageTexture("a.png")}, {"lamp": (0.5, 0.0, 1.0)},
        "specular", False, True, 16, True,
    )  # fmt: skip
    assert Wish.of(json.loads(json.dumps(wish.said()))) == wish and Wish.of(Wish(4).said()) == Wish(4)
    assert wish.numbered(5) == Wish.of({**wish.said(), "number": 5})
    wishes = Wishes(iter([]))
    assert wishes.newest(None) is None, "the stream has ended"
    lines = queue.Queue()
    wishes = Wishes(iter(lines.get, None))
    first = Wish(1, ("traced",), FRONT)
    lines.put(json.dumps(first.said()).encode())
    read = wishes.newest(None)
    assert read == first and wishes.stands(read)
    lines.put(json.dumps(Wish(2, ("traced",), SIDE).said()).encode())
    second = wishes.newest(read)
    assert second.number == 2 and not wishes.stands(read)
    lines.put(None)
    assert wishes.newest(second) is None


class Sampled:
    """A traced picture whose samples and denoising take the time of a clock."""

    path = False

    def __init__(self, clock, sample_s, fast_s):
        self.samples, self._clock, self._sample_s, self._fast_s = 0, clock, sample_s, fast_s
        self.denoised_fast = []

    def sample(self, most):
        count = max(1, min(most, 2))
        self.samples += count
        self._clock[0] += count * self._sample_s
        return count

    def denoised(self, *, fast):
        self._clock[0] += self._fast_s * (1 if fast else 2)
        self.denoised_fast.append(fast)
        return np.zeros((2, 2, 3), np.float32)


@pytest.fixture
def clock(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("lambent.viewer.modes.walk.at_rest.tracing_worker.time.monotonic", lambda: now[0])
    return now


def sent(clock, samples, sample_s=0.1, fast_s=0.35):
    """Times, and samples, of the pictures that are sent."""
    picture = Sampled(clock, sample_s, fast_s)
    one, found = Converging("traced", picture, samples), []
    while clock[0] < 60 and not one.done:
        one.sample()
        if one.due:
            one.image()
            found.append((clock[0], picture.samples))
    return found, picture.denoised_fast


def test_the_first_picture_has_one_sample_and_later_ones_are_worth_their_time(clock):
    found, fast = sent(clock, 0)
    times, samples = zip(*found, strict=True)
    assert samples[0] == 1 and times[0] == pytest.approx(0.45)
    assert all(b - a >= PICTURE_S for a, b in itertools.pairwise(times))
    assert max(np.diff(times[:4])) < 1.1, "about every half second at first, beside denoising"
    assert samples[-1] > 0.7 * 60 / 0.1, "most of the time is for samples"
    late = [b - a for a, b in itertools.pairwise(times) if a > 20]
    assert min(late) > 0.9 * GROWTH * 20
    assert fast[0] and not fast[-1] and sorted(fast, reverse=True) == fast, "fine once it is a small share"


def test_a_picture_of_a_number_of_samples_is_sent_once(clock):
    found, fast = sent(clock, 16)
    assert [samples for _, samples in found] == [16] and fast == [False]


def reports(tracing, woken):
    """Wait until the process reports, and take what it has said."""
    woken.get(timeout=LONGEST_S)
    tracing.tick()


def test_a_process_that_is_killed_while_it_writes_is_a_line(monkeypatch):
    """Every report wakes the window, the end as well, and none counts before the next `tick`."""
    monkeypatch.setattr("lambent.viewer.modes.walk.at_rest.tracing.WORKER", "tests.viewer.dying_worker")
    monkeypatch.chdir(ROOT)
    woken = queue.SimpleQueue()
    tracing = Tracing(Path("none.store"), 0.0, (), lambda: woken.put(None))
    tracing.start()
    tracing.ask(Wish(0, ("traced",)))
    tracing._process._work.wait()  # all is said, nothing is taken
    assert not tracing.ready and tracing.last("traced") is None and tracing.error == ""
    assert woken.qsize() == 4
    reports(tracing, woken)
    assert tracing.ready and "tracing was killed by SIGKILL" in tracing.error
    found = tracing.last("traced")
    assert found.samples == 1 and found.radiance.shape == (HEIGHT, WIDTH, 3) and (found.radiance == 1).all()
    tracing.close()


@pytest.mark.long
def test_a_store_without_a_scene_is_a_line(adapter, screen, tmp_path):
    """And the drawn picture stays."""
    folder = write_small_store(tmp_path / "small.store")
    renderer = Renderer(open_device(), Store.open(folder))
    state = WalkState.of(renderer.scene.record, "walk", screen, folder)
    pictures, began_s = Pictures(renderer, state), time.monotonic()
    while not pictures._at_rest.fault and time.monotonic() - began_s < LONGEST_S:
        drawn(pictures, state, SIZE)
        time.sleep(POLL_S)
    drawn(pictures, state, SIZE, 2)
    (said,) = [message.text for message in state.screen.messages if "not traced" in message.text]
    assert "no path of its scene file" in said and "\n" not in said
    assert pictures.shown == (pictures._a,) and pictures.wait_s() is None
    state.comparison.mode = "side by side"
    drawn(pictures, state, SIZE)
    assert "no path of its scene file" in state.comparison.fault and len(pictures.shown) == 1
    pictures.close()


def test_without_a_store_b_cannot_be_traced(adapter, screen, tmp_path):
    renderer = Renderer(open_device(), Store.open(write_small_store(tmp_path / "small.store")))
    state = WalkState.of(renderer.scene.record, "walk", screen)
    pictures = Pictures(renderer, state)
    state.comparison.mode = "side by side"
    drawn(pictures, state, SIZE)
    assert "no scene file" in state.comparison.fault and len(pictures.shown) == 1
