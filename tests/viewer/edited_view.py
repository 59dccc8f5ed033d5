"""A view of two materials and its transport, written by hand, and a bake that takes no time."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from lambent.baked.shared_exponent import packed_rgb
from lambent.baked.transport.wavelets import transformed
from lambent.core.views.camera import Camera
from lambent.editing.session.session import Session
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import patch
from lambent.scenes.scene import Scene, SceneObject
from lambent.store.contract import TRANSPORT_BASIS, view_artefact_name, view_meta
from lambent.store.store import Store
from lambent.viewer.modes.edit import painter
from lambent.viewer.modes.edit.state import EditState
from lambent.viewer.modes.edit.subject import Subject

CAMERA, SIZE = Camera("front", (0.0, 1.0, 3.0), (0.0, 0.0, 0.0)), (8, 6)
TRAY = Material(name="tray", kd=(0.3, 0.2, 0.1), lobes=(Lobe(mx=0.3, my=0.3),))
WALL = Material(name="wall", kd=0.5)
OTHER_TRAY = TRAY.model_copy(update={"lobes": (Lobe(mx=0.3, my=0.3, alpha=0.5),)})  # of another quotient
SHOWN = {"tray": np.arange(3, 20), "wall": np.arange(20, 41)}
OBJECTS = (("plate", "tray"), ("back", "wall"))
LIGHTS = (20, 60)
SCENE = Scene(
    "small room",
    tuple(SceneObject(name, patch((-1, 0, -1), (2, 0, 0), (0, 0, 2)), material) for name, material in OBJECTS),
    {"tray": TRAY, "wall": WALL, "unused": WALL}, cameras=(CAMERA, replace(CAMERA, name="side")),
)  # fmt: skip


def write_view(folder, session, lights, seed=0):
    """The points of the view, and transport for the materials of a session."""
    meta, merged = view_meta(CAMERA, *SIZE), session.document.merged
    with Store.create(folder, {}) as store:

        def put(kind, part, array, **more):
            store.put(
                view_artefact_name(CAMERA, *SIZE, kind, part),
                kind,
                array,
                key=f"{time.time_ns()}",
                meta={**meta, **more},
            )

        worn = np.concatenate([np.full(len(pixel), k) for k, pixel in enumerate(SHOWN.values())])
        put("view_points", "pixel", np.concatenate(list(SHOWN.values())).astype(np.uint32))
        put(
            "view_points",
            "object",
            worn.astype(np.uint32),
            objects=[[name, merged.get(own, own)] for name, own in OBJECTS],
        )
        put("view_points", "theta_o", np.zeros(len(worn), np.float32))
        put("view_points", "backdrop", np.full((SIZE[1], SIZE[0], 3), 0.125, np.float16))
        rng, said = np.random.default_rng(lights + seed), []
        for name in session.document.materials:
            pixels = np.concatenate([shown for own, shown in SHOWN.items() if merged.get(own, own) == name])
            for k, term in enumerate(session.original(name).terms):
                counts = [8 for _ in term.factors]
                said.append(
                    {"material": name, "term": k, "fixed": term.fixed, "scale": 0.25, "basis": TRANSPORT_BASIS,
                     "curves": [[f.curve, 8] for f in term.factors]}
                )  # fmt: skip
                light = rng.random((*counts, 3, len(pixels))).astype(np.float32)
                if len(counts) == 1:
                    put("transport", f"{lights}/{name}/{k}/rows", transformed(light).astype(np.float16))
                    continue
                begin = np.arange(len(pixels)) * 64
                put("transport", f"{lights}/{name}/{k}/spans", np.stack([begin, begin + 64], axis=1).astype(np.uint32))
                put("transport", f"{lights}/{name}/{k}/steps", np.ones(64 * len(pixels), np.uint8))  # all pairs in turn
                values = packed_rgb(np.moveaxis(light, 3, 0).reshape(-1, 3))
                put("transport", f"{lights}/{name}/{k}/values", values)
        put("transport", f"{lights}/terms", np.ones(len(said), np.uint32), terms=said)


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
        write_view(self.store, Session(self.document), lights, seed)
        self.has_view = True
        self.arrived.append(lights)
        self.running = lights != LIGHTS[-1]

    def close(self):
        self.closed, self.running = True, False


def new_state(screen, folder, backend=None, **materials):
    """The state on a scene whose store is not there yet, and its bakes."""
    session = Session.new("small room", CAMERA, {"tray": TRAY, "wall": WALL, **materials}, size=SIZE)
    bakes = Bakes()
    return EditState(
        Subject(session, SCENE, folder, folder / "store", None), screen, LIGHTS, bakes, backend=backend
    ), bakes


def until(state, condition):
    """Let the state go on until it meets a condition."""
    end = time.monotonic() + 180  # never reached but by a machine at a standstill
    while not condition():
        assert time.monotonic() < end, "not in time"
        state.tick()
        time.sleep(0.005)


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
