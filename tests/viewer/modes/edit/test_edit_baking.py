"""The bake beside the window: its progress, its time left, its errors, its end."""

from __future__ import annotations

import time

import pytest

from lambent.baking.interreflection.proposal import Proposal, Row
from lambent.baking.interreflection.settings import Bounces
from lambent.editing.session.session import Session
from lambent.viewer.modes.edit import baking
from lambent.viewer.modes.edit.baking import Baking, Passes, Stage
from tests.viewer.edited_view import CAMERA, SIZE, TRAY
from tests.viewer.waiting import until

TALKS = """
import json, sys, time
def say(**words): print(json.dumps(words), flush=True)
say(what="views", done=1, total=1)
say(what="visibility of 20 lights", done=0, total=1)
say(lights=20)
{end}
"""


@pytest.fixture
def begun(tmp_path, monkeypatch):
    """A bake by a worker that ends with a statement."""

    def begin(end):
        (tmp_path / "talking_worker.py").write_text(TALKS.format(end=end))
        monkeypatch.syspath_prepend(tmp_path)
        monkeypatch.setattr(baking, "WORKER", "talking_worker")
        return Baking(Session.new("builtin:box", CAMERA, {"tray": TRAY}, size=SIZE), tmp_path / "store", (20,))

    return begin


def test_what_arrives_is_told_and_a_good_end_has_no_error(begun):
    bake = begun("")
    until(lambda: not bake.running)
    assert (bake.arrived, bake.has_view, bake.error) == ([20], True, "")


@pytest.mark.parametrize(
    ("end", "line"),
    [
        ("say(error='scene.toml: file does not exist')", "scene.toml: file does not exist"),
        ("raise RuntimeError('no memory')", "the bake ended with 1 (RuntimeError: no memory)"),
        ("sys.exit(3)", "the bake ended with 3 (no message)"),
    ],
)
def test_errors_are_one_line(begun, end, line):
    bake = begun(end)
    until(lambda: not bake.running)
    assert bake.error == line


def test_closing_ends_the_process(begun):
    bake = begun("time.sleep(600)")
    until(lambda: bake.arrived)
    process = bake._process._process
    began = time.monotonic()
    bake.close()
    assert process.poll() is not None and time.monotonic() - began < 60  # it sleeps for 600
    assert not bake.running and bake.error == ""
    bake.close()


def test_the_time_left_counts_down_by_the_weights_of_steps():
    stage = Stage({"tray: diffuse": 1.0, "tray: specular": 8.0}, 0.0)
    stage.take("visibility of 398 lights", 0.0, 398, 10.0)
    assert stage.left_s(10.0) is None
    stage.take("tray: diffuse, 398 lights", 0.0, 398, 11.0)
    stage.take("tray: specular, 398 lights", 0.0, 398, 12.0)
    assert stage.left_s(12.0) == pytest.approx(8.0) and stage.left_s(15.0) == pytest.approx(5.0)
    stage.take("tray: specular, 398 lights", 0.5, 398, 14.0)
    assert stage.left_s(14.0) == pytest.approx(4 * 4 / 6)
    stage.take("visibility of 3998 lights", 0.0, 3998, 20.0)
    assert stage.lights == 3998 and stage.left_s(20.0) is None


def test_the_time_left_is_that_of_the_last_two_passes():
    passes = Passes(64)
    for before, samples in ((0, 16), (16, 32)):  # are there already
        passes.take(before, samples, 1.0, 5.0)
    assert passes.left_s(5.0) is None
    passes.take(32, 64, 0.0, 10.0)
    assert passes.left_s(11.0) is None
    passes.take(32, 64, 0.25, 14.0)
    assert passes.left_s(14.0) == pytest.approx(12.0) and passes.left_s(16.0) == pytest.approx(10.0)
    slow = Passes(64)
    for before, samples, now_s in ((0, 16, 0.0), (16, 32, 100.0), (32, 64, 108.0)):
        slow.take(before, samples, 0.0, now_s)
    assert slow.left_s(108.0) == pytest.approx(16.0), "the first pass, in which kernels are compiled, no longer counts"


def test_a_proposal_is_told(tmp_path):
    bake = Baking.__new__(Baking)
    bake.proposal = None
    found = Proposal(Bounces(fixed=frozenset({"wall"})), (Row("tray", "edited", 5, 0.5, 0.1),), {}, {}, 10, 20)
    bake.take({"proposal": found.said()})
    assert bake.proposal == found
