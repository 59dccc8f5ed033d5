"""A small view of the tea tray, baked for relighting, and states of the mode on it."""

import shutil

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.transport.view import View
from lambent.core.pictures.images import write_image
from lambent.scenes.loaders.load import load_scene
from lambent.store.kept.session import FILE, RoomState, WalkSession, write_session
from lambent.store.store import Store
from lambent.viewer.edits.shown import OnHost
from lambent.viewer.modes.relight import state as relight_state
from lambent.viewer.modes.relight.state import RelightState
from lambent.viewer.screen import Screen
from tests.viewer import waiting

SIZE = 16, 12


@pytest.fixture(scope="session")
def baked_tray(mi, tmp_path_factory):
    scene, folder = load_scene("builtin:teatray"), tmp_path_factory.mktemp("relit") / "tray.store"
    bake(scene, folder, only={"relighting"}, views=[View(scene.cameras[0], *SIZE)]).close()
    return folder


@pytest.fixture
def tray(baked_tray, tmp_path):
    """A copy that a test may change."""
    shutil.copytree(baked_tray, tmp_path / "tray.store")
    return tmp_path / "tray.store"


@pytest.fixture
def gold_tray(tray):
    """The tray whose room has another material than the bake; its picture before is that of the bake."""
    gold = load_scene("builtin:teatray").materials["nickel"].model_copy(update={"kd": (0.9, 0.6, 0.1)})
    write_session(tray / FILE, WalkSession(now=RoomState(materials={"nickel": gold})))
    return tray


@pytest.fixture
def sky(tmp_path):
    """An image with a bright side."""
    picture = np.full((8, 16, 3), 0.2, np.float32)
    picture[:3, 2:5] = (9.0, 6.0, 3.0)
    write_image(tmp_path / "sky.exr", picture)
    return tmp_path / "sky.exr"


class InThisProcess:
    """A bake without a worker: at once, or when the test lets it."""

    waits, error = False, ""

    def __init__(self, relit, wake):
        self.relit, self.closed, self.line = relit, False, "baking by hand"
        self.begun.append(self)

    @property
    def running(self):
        if not (self.waits or self.error):
            self.relit.bake()
        return self.waits

    def close(self):
        self.closed = True


@pytest.fixture
def bakes(monkeypatch):
    """The class of bakes, with those that were begun."""

    kind = type("Bakes", (InThisProcess,), {"begun": []})
    monkeypatch.setattr(relight_state, "ViewBake", kind)
    return kind


@pytest.fixture
def opened(tmp_path, bakes):
    """Function that opens the mode on a store; all are closed at the end."""
    states = []

    def start(store, **options):
        states.append(RelightState(Store.open(store), Screen(tmp_path), OnHost(), **options))
        return states[-1]

    yield start
    for state in states:
        state.close()


def settled(state):
    """Let the state come to rest; its picture, or None."""

    def rests():
        state.tick()
        return not state.busy and (state.is_current or bool(state.trouble))

    waiting.until(rests)
    return None if state.frame is None else state.frame.shown.radiance
