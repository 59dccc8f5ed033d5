"""Light baked anew beside the window: into a copy of the store, and region by region into the picture."""

import json
import re
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from lambent.baking.running.again import rebaked_copy
from lambent.core.light.light_mix import GroupMix, LightMix
from lambent.realtime.gpu.device import open_device
from lambent.realtime.renderer import Renderer
from lambent.store.store import Store
from lambent.viewer.modes.walk.light.answering import AnsweringLight
from lambent.viewer.modes.walk.pictures import Pictures
from lambent.viewer.modes.walk.rebake import rebaking
from lambent.viewer.modes.walk.rebake.rebaking import clock_time
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.screen import Rect
from tests.viewer.modes.walk.rebake.recorded_bakes import painted
from tests.viewer.window_session import ROOT

SIZE = (64, 48)
PLACE = Rect(0, 0, *SIZE)
LONGEST_S = 180.0
WORKER = """
import json, sys, time
from pathlib import Path
asked = json.loads(sys.stdin.readline())
def say(**words):
    print(json.dumps(words), flush=True)
say(what="light map", done=1, total=4)
{then}
"""
ENDLESS = """
import runpy, sys, time
import lambent.baking.running.again
def endless(*_, **__):
    print("begun", flush=True)
    time.sleep(60)
lambent.baking.running.again.bake_again = endless
runpy.run_module("lambent.viewer.modes.walk.rebake.rebaking_worker", run_name="__main__", alter_sys=False)
"""


class Room:
    """The walk's pictures on a store whose worker is a script."""

    def __init__(self, folder, screen, monkeypatch, tmp_path, then):
        screen.pace.adaptive = screen.pace.traces = False
        screen.clock = time.monotonic
        (tmp_path / "baking_worker.py").write_text(WORKER.format(then=then))
        monkeypatch.syspath_prepend(tmp_path)
        monkeypatch.setattr(rebaking, "WORKER", "baking_worker")
        monkeypatch.setattr(rebaking, "QUIET_S", 0.1)
        opened = Store.open(folder)
        self.renderer = Renderer(open_device(), opened)
        self.state = WalkState.of(self.renderer.scene.record, "walk", screen, folder)
        groups = self.renderer.scene.groups
        self.state.lights.groups = () if groups is None else groups.records
        self.state.look.exposure_ev, self.state.meter.expose_wanted = 0.0, False
        self.pictures = Pictures(self.renderer, self.state, AnsweringLight(opened, self.renderer, self.state.answering))
        self.lines, self.seen = [], []

    def frame(self):
        self.pictures.update(PLACE, 1.0)
        self.lines.append(self.state.rebaking.line)

    def until(self, condition):
        end = time.monotonic() + LONGEST_S
        while not condition():
            assert time.monotonic() < end, self.lines[-3:]
            self.frame()
            self.seen.append(self.renderer.resources.light_layers[0][..., :3].astype(np.float32))
            time.sleep(0.002)

    def paint(self):
        self.state.materials.edits.set_materials(painted(self.state.scene))


@pytest.fixture
def opened(boxes, screen, monkeypatch, tmp_path):
    """Opens a box with the worker `then`, by default one that replays recorded bakes."""
    made = []

    def open_box(groups="none", then=None):
        box = boxes[groups]
        made.append(Room(box.store, screen, monkeypatch, tmp_path, then or box.replays()))
        return made[-1]

    yield open_box
    for room in made:
        room.pictures.close()


@pytest.fixture
def room(opened):
    return opened()


def image(renderer, state, light=()):
    return image_of(renderer, state, state.materials.edits.edited, light)


def image_of(renderer, state, materials, light=()):
    frame = state.look.frame(state.navigation.camera, SIZE, materials)
    waits, renderer.waits = renderer.waits, True
    found = renderer.image(replace(frame, light=dict(light)))
    renderer.waits = waits
    return found


@pytest.mark.long
def test_an_edit_is_estimated_then_baked_then_exact(boxes, opened, store, tmp_path):
    flag = tmp_path / "go on"
    room = opened(then=boxes["none"].replays(flag))
    state = room.state
    room.paint()
    room.until(lambda: "25 %" in state.rebaking.line)
    flag.touch()
    room.until(lambda: state.rebaking.exact)
    truth = Renderer(open_device(), Store.open(rebaked_copy(store)))
    np.testing.assert_allclose(image(room.renderer, state), image(truth, state), rtol=2e-3, atol=1e-4)
    assert any(
        re.fullmatch(r"baking again \d:\d\d \(first bake \d:\d\d\): light map 25 %", line) for line in room.lines
    )
    assert state.rebaking.line == "exact: baked again" and "exact again" in state.screen.messages[-1].text
    estimated = next(n for n, line in enumerate(room.lines) if "; new light on" in line or "blending in" in line)
    whole = np.abs(room.seen[-1] - room.seen[estimated - 1])
    frames = np.array([np.abs(b - a) for a, b in zip(room.seen[estimated - 1 :], room.seen[estimated:], strict=False)])
    assert whole.max() > 0.01, "the estimate was one"
    way = frames.sum(axis=0)  # longer than the difference where the first light to arrive was brighter or darker
    assert (frames.max(axis=0) <= 0.25 * way + 2e-3 * room.seen[-1] + 1e-6).all(), "no texel jumps"
    version = room.renderer.light_version
    for _ in range(3):
        room.frame()
    assert room.renderer.light_version == version and room.pictures.wait_s() is None, "then nothing goes on"


@pytest.mark.long
def test_another_edit_ends_it_and_undo_comes_back_without_a_bake(room):
    state, edits = room.state, room.state.materials.edits
    baked = image(room.renderer, state)
    room.paint()
    room.until(lambda: state.rebaking.exact)
    exact = image(room.renderer, state)
    assert room.pictures._appearance.rebaked, "the process that traces may read it"
    edits.undo()
    room.frame()
    assert not state.rebaking.exact and state.rebaking.line == "" and not room.pictures._appearance.rebaked
    room.until(lambda: not room.pictures._lane.busy)
    np.testing.assert_allclose(image(room.renderer, state), baked, rtol=1e-3, atol=1e-5)
    edits.redo()
    process = room.pictures._rebaked._process
    room.until(lambda: state.rebaking.exact)
    assert process is None and room.pictures._rebaked._process is None
    np.testing.assert_allclose(image(room.renderer, state), exact, rtol=1e-3, atol=1e-5)


@pytest.mark.long
@pytest.mark.parametrize("groups", ["none", "scene"])
def test_a_state_that_goes_beside_keeps_its_light_and_undo_of_all_is_as_baked(opened, groups):
    room = opened(groups)
    state, edits = room.state, room.state.materials.edits
    baked = image(room.renderer, state)
    room.paint()
    room.until(lambda: state.rebaking.exact)
    exact = image(room.renderer, state)
    state.states.split = True
    for _ in range(3):
        room.frame()
    state.states.exchange()
    room.frame()
    room.until(lambda: not (room.pictures._lane.busy or room.pictures._other_lane.busy))
    assert not state.rebaking.exact and room.pictures._other_lane.renderer is room.renderer
    beside = image_of(room.renderer, state, edits.other.materials)
    np.testing.assert_allclose(beside, exact, rtol=2e-3, atol=1e-5)
    np.testing.assert_allclose(image(room.pictures._lane.renderer, state), baked, rtol=2e-3, atol=1e-5)
    while edits.can_undo:
        edits.undo()
    state.states.split = False
    room.frame()
    room.until(lambda: not room.pictures._lane.busy)
    np.testing.assert_allclose(image(room.pictures._lane.renderer, state), baked, rtol=2e-3, atol=1e-5)


@pytest.mark.long
@pytest.mark.parametrize("groups", ["none", "scene"])
def test_objects_whose_light_is_finished_go_over_while_others_are_baked(boxes, opened, tmp_path, groups):
    flag = tmp_path / "go on"
    room = opened(groups, boxes[groups].replays(flag, waits_at=1))
    state, rebaked = room.state, room.pictures._rebaked
    room.paint()
    room.frame()
    room.until(lambda: not room.pictures._lane.busy)
    estimate = room.renderer.resources.light_layers[0].astype(np.float32)
    room.until(lambda: rebaked._fade is not None and rebaked._light.lit.any() and rebaked._fade.shown is rebaked._light)
    room.until(lambda: not rebaked._fade.moves and rebaked._fade.shown is rebaked._light)
    lit, texel_object = rebaked._light.lit, rebaked._light.texel_object
    shown = room.renderer.resources.light_layers[0].astype(np.float32)
    theirs = np.append(lit, False)[texel_object]
    assert lit.any() and not lit.all() and not state.rebaking.exact
    assert f"new light on {lit.sum()} of {len(lit)} objects" in state.rebaking.line
    np.testing.assert_array_equal(shown[~theirs], estimate[~theirs])
    assert np.abs(shown - estimate)[theirs].mean() > 1e-3
    flag.touch()
    room.until(lambda: state.rebaking.exact)
    truth = Renderer(open_device(), Store.open(rebaked_copy(boxes[groups].store)))
    np.testing.assert_allclose(image(room.renderer, state), image(truth, state), rtol=4e-3, atol=1e-4)
    whole = room.renderer.resources.light_layers[0].astype(np.float32)
    off = np.abs(shown - whole)[theirs].mean() / np.abs(estimate - whole)[theirs].mean()
    assert off < 0.5, "early light is near to the final one"


@pytest.mark.long
def test_light_of_an_edit_that_was_given_up_is_not_shown(boxes, opened, store, tmp_path):
    """A second edit comes while the first one's light goes in: nothing of the first stays."""
    flag = tmp_path / "go on"
    room = opened(then=boxes["none"].replays(flag, waits_at=1))
    state, rebaked, edits = room.state, room.pictures._rebaked, room.state.materials.edits
    room.paint()
    room.until(lambda: rebaked._fade is not None and rebaked._fade.moves)
    name = sorted(state.scene.materials)[0]
    blue = {name: state.scene.materials[name].model_copy(update={"kd": (0.2, 0.3, 0.7)})}
    edits.set_materials(blue)
    boxes["none"].record("blue", {**painted(state.scene), **blue})
    room.frame()
    assert rebaked._fade is None and rebaked._light is None and state.rebaking.share is None
    flag.touch()
    room.until(lambda: state.rebaking.exact)
    truth = Renderer(open_device(), Store.open(rebaked_copy(store)))
    np.testing.assert_allclose(image(room.renderer, state), image(truth, state), rtol=2e-3, atol=1e-4)


@pytest.mark.long
def test_without_answers_an_edit_goes_from_as_baked_to_exact_and_back(room):
    state, edits = room.state, room.state.materials.edits
    state.answering.on = False
    baked = image(room.renderer, state)
    room.paint()
    room.until(lambda: state.rebaking.exact)
    exact = image(room.renderer, state)
    state.answering.on = True
    room.frame()
    assert not state.rebaking.exact, "the estimate first"
    room.until(lambda: state.rebaking.exact)
    np.testing.assert_allclose(image(room.renderer, state), exact, rtol=2e-3, atol=1e-5)
    state.answering.on = False
    room.frame()
    edits.undo()
    room.frame()
    room.until(lambda: not room.pictures._lane.busy)
    np.testing.assert_allclose(image(room.renderer, state), baked, rtol=2e-3, atol=1e-5)


@pytest.mark.long
def test_mixes_of_light_groups_are_exact_too(boxes, opened):
    room = opened("scene")
    state = room.state
    name = state.lights.groups[0].name
    room.paint()
    room.until(lambda: state.rebaking.exact)
    state.lights.mix = LightMix({name: GroupMix(intensity=0.25)})
    state.materials.edits.end_stroke()
    room.frame()
    assert state.rebaking.exact
    room.until(lambda: not room.pictures._lane.busy)
    truth = Renderer(open_device(), Store.open(rebaked_copy(boxes["scene"].store)))
    light = state.recordings.light
    np.testing.assert_allclose(
        image(room.renderer, state, light.items()), image(truth, state, light.items()), rtol=4e-3, atol=1e-4
    )
    state.materials.edits.take(state.materials.edits.room.model_copy(update={"materials": {}}))
    room.until(lambda: not state.rebaking.exact and not room.pictures._lane.busy)
    plain = Renderer(open_device(), Store.open(boxes["scene"].store))
    np.testing.assert_allclose(
        image(room.renderer, state, light.items()), image(plain, state, light.items()), rtol=4e-3, atol=1e-4
    )


def test_an_edit_meanwhile_and_closing_end_the_process(opened):
    room = opened(then="time.sleep(600)")
    room.paint()
    room.until(lambda: "25 %" in room.state.rebaking.line)
    first = room.pictures._rebaked._process._process
    room.state.materials.edits.undo()
    room.frame()
    assert first.poll() is not None and room.state.rebaking.line == ""
    room.state.materials.edits.redo()
    room.until(lambda: "25 %" in room.state.rebaking.line)
    second = room.pictures._rebaked._process._process
    began_s = time.monotonic()
    room.pictures.close()
    assert second.poll() is not None and time.monotonic() - began_s < 60  # it sleeps for 600


@pytest.mark.parametrize(
    ("then", "line"),
    [
        ("say(error='room.toml: file does not exist')", "not baked again: room.toml: file does not exist"),
        ("sys.exit(0)", "not baked again: the bake ended too soon"),
    ],
)
def test_faults_are_one_line_and_the_estimate_stays(opened, then, line):
    room = opened(then=then)
    room.paint()
    room.until(lambda: "not baked again" in room.state.rebaking.line)
    assert line in room.state.rebaking.line and not room.state.rebaking.exact
    for _ in range(3):
        room.frame()
    assert room.pictures._rebaked._process is None, "it is not tried again until something changes"
    room.state.rebaking.on = False
    room.frame()
    assert room.state.rebaking.line == ""
    room.state.rebaking.on = True
    room.until(lambda: room.pictures._rebaked._process is not None)
    room.until(lambda: "not baked again" in room.state.rebaking.line)
    room.state.materials.edits.undo()
    room.frame()
    assert room.state.rebaking.line == "", "the light of the room as baked has no fault"


@pytest.mark.long
def test_the_worker_says_what_is_wrong_in_a_line(store, tmp_path):
    """The real process; the quality of this store has no name."""
    command = [sys.executable, "-m", f"{rebaking.__name__}_worker", str(store), str(tmp_path / "copy")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.stdin.write(json.dumps({"materials": {}, "textures": {}}).encode() + b"\n")
        process.stdin.flush()
        said = json.loads(process.stdout.readline())
    assert "unknown quality" in said["error"] and process.returncode == 0


@pytest.mark.long
def test_the_worker_ends_with_the_window(store, tmp_path):
    """The end of stdin is that of a window that was killed; this bake would take minutes."""
    copy = tmp_path / "copy"
    command = [sys.executable, "-c", ENDLESS, str(store), str(copy)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, cwd=ROOT) as process:
        process.stdin.write(json.dumps({"materials": {}, "textures": {}}).encode() + b"\n")
        process.stdin.flush()
        assert b"begun\n" in iter(process.stderr.readline, b""), "what libraries print goes there"
        process.stdin.close()
        assert process.wait(10) == 0


@pytest.mark.parametrize(("seconds", "shown"), [(65.9, "1:05"), (14962, "4:09:22")])
def test_clock_time_has_hours_where_there_are_some(seconds, shown):
    assert clock_time(seconds) == shown
