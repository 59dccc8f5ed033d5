"""The state of editing a small view in place, and a bake that takes no time."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from lambent.core.plain import triple
from lambent.core.views.camera import Camera
from lambent.editing.curves.nodes import Which, pulled, values_of, with_values
from lambent.editing.session.session import Session
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import patch
from lambent.scenes.scene import Scene, SceneObject
from lambent.store.store import Store
from lambent.viewer.edits.edits import MaterialEdits
from lambent.viewer.edits.view_steps import ViewSteps
from lambent.viewer.modes.edit import painter
from lambent.viewer.modes.edit.state import EditState
from lambent.viewer.modes.edit.subject import Subject
from tests.editing.written_view import OBJECTS, SHOWN, SIZE, write_view
from tests.viewer import waiting

CAMERA = Camera("front", (0.0, 1.0, 3.0), (0.0, 0.0, 0.0))
TRAY = Material(name="tray", kd=(0.3, 0.2, 0.1), lobes=(Lobe(mx=0.3, my=0.3),))
WALL = Material(name="wall", kd=0.5)
OTHER_TRAY = TRAY.model_copy(update={"lobes": (Lobe(mx=0.3, my=0.3, alpha=0.5),)})  # of another quotient
LIGHTS = (20, 60)
SCENE = Scene(
    "small room",
    tuple(SceneObject(name, patch((-1, 0, -1), (2, 0, 0), (0, 0, 2)), material) for name, material in OBJECTS.items()),
    {"tray": TRAY, "wall": WALL, "unused": WALL}, cameras=(CAMERA, replace(CAMERA, name="side")),
)  # fmt: skip


def pull(session, name, kind="shape", by=2.0, node=0):
    """Pull a node of a material's curve by a factor, with its neighbours."""
    material, which = session.material(name).now, Which(kind)
    values = values_of(material, which)
    pull = pulled(values, node, by * float(values[node].max()), tuple(range(values.shape[1])), soft=True)
    session.change(name, with_values(material, which, pull))


def tint(session, name, colour):
    """Multiply a material's diffuse colour."""
    material = session.material(name).now
    session.change(name, material.model_copy(update={"kd": triple(np.multiply(material.kd, colour))}))


def write_light(folder, session, lights, seed=0):
    """Write the view with random transport for the materials of a session."""
    merged, rng, light = session.document.merged, np.random.default_rng(lights + seed), {}
    for name in session.document.materials:
        points = sum(len(shown) for own, shown in SHOWN.items() if merged.get(own, own) == name)
        terms = session.original(name).terms
        light[name] = [(t, rng.random((*[8] * len(t.factors), 3, points)).astype(np.float32)) for t in terms]
    with Store.create(folder, {}) as store:
        write_view(store, CAMERA, lights, light, f"{time.time_ns()}", merged)


class Bakes:
    """Makes bakes, and keeps those that were begun; `asked` are those that are to make a proposal."""

    def __init__(self):
        self.begun, self.asked = [], []

    def __call__(self, session, store, lights=(), bounces=None, proposing=None):
        kept = self.begun if proposing is None else self.asked
        kept.append(HandBake(session, store))
        kept[-1].bounces, kept[-1].kept = bounces, proposing
        return kept[-1]


class HandBake:
    """A bake that has what a test gives it."""

    def __init__(self, session, store):
        self.document, self.store, self.line, self.error = session.document, store, "baking by hand", ""
        self.proposal, self.samples = None, 0
        self.session, self.arrived, self.has_view, self.running, self.closed = session, [], False, True, False

    def weigh(self, shares):
        self.shares = shares

    def arrive(self, lights, seed=0):
        write_light(self.store, Session(self.document), lights, seed)
        self.has_view = True
        self.arrived.append(lights)
        self.running = lights != LIGHTS[-1]

    def close(self):
        self.closed, self.running = True, False


def new_state(screen, folder, backend=None, **materials):
    """The state on a scene whose store is not there yet, and its bakes."""
    edits = MaterialEdits({**SCENE.materials, **materials})
    begun = Session.new("small room", CAMERA, {"tray": TRAY, "wall": WALL, **materials}, size=SIZE).document
    session, bakes = Session(ViewSteps(edits, begun)), Bakes()
    subject = Subject(session, edits, SCENE, folder, folder / "store", None)
    return EditState(subject, screen, LIGHTS, bakes, backend=backend), bakes


def until(state, condition):
    """Let the state go on until it meets a condition."""
    waiting.until(condition, state.tick)


def settled(state):
    """Let the picture come to rest; its last frame.

    A tick at rest may still change the exposure: rest is a tick that finds and leaves nothing to do.
    """

    def rests():
        return not state.painter.busy and not state.loading.busy

    def rested():
        before = rests()
        state.tick()
        return before and rests()

    until(state, rested)
    return state.painter.frame


def lit_state(monkeypatch, screen, tmp_path):
    """A state whose bakes have all arrived, drawn without waiting."""
    monkeypatch.setattr(painter, "FADE_S", 0.01)
    monkeypatch.setattr(painter, "FRAME_S", 0.001)
    state, bakes = new_state(screen, tmp_path)
    until(state, lambda: bakes.begun)
    for lights in LIGHTS:
        bakes.begun[0].arrive(lights)
        until(state, lambda lights=lights: state.loading.lights == lights)
    settled(state)
    return state
