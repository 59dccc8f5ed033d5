"""Interreflections beside the window: when they are baked, read, taken away and begun anew. No bake is run."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from lambent.core.camera import Camera
from lambent.core.errors import UserError
from lambent.editing.session import Session
from lambent.materials.document import Material
from lambent.viewer.modes.edit import interreflections
from lambent.viewer.modes.edit.baking import Wanted
from lambent.viewer.modes.edit.interreflections import Bounced
from tests.viewer.test_editor_state import PATIENCE_S

NAMES = [f"material {k}" for k in range(8)]
SHARES = {name: 1.0 / (k + 1) for k, name in enumerate(NAMES)}


class Bake:
    """A bake that a test drives."""

    def __init__(self, session, folder, bounces):
        self.bounces, self.samples, self.running, self.error, self.line, self.closed = (
            bounces,
            0,
            True,
            "",
            "baking",
            False,
        )

    def close(self):
        self.closed, self.running = True, False


@pytest.fixture
def made(monkeypatch, tmp_path):
    """Interreflections of a store that has `made.held` samples, the bakes that were begun, what the painter got."""
    held, bakes, given = {"samples": 0}, [], []
    monkeypatch.setattr(interreflections, "samples_of", lambda store, session: held["samples"])
    monkeypatch.setattr(interreflections, "interreflections", lambda *_: held["samples"])
    monkeypatch.setattr(interreflections.Store, "open", lambda folder: None)
    painter = SimpleNamespace(run=lambda task: task(), give=given.append)

    def bake(*words, **more):
        bakes.append(Bake(*words, **more))
        return bakes[-1]

    (tmp_path / "manifest.json").touch()
    session = Session.new("room", Camera("front", (0, 0, 1), (0, 0, 0)), {name: Material(kd=0.5) for name in NAMES})
    return SimpleNamespace(
        bounced=Bounced(painter, bake), session=session, folder=tmp_path, held=held, bakes=bakes, given=given
    )  # fmt: skip


def tick(made, idle=True):
    """Until nothing is read."""
    import time

    end = time.monotonic() + PATIENCE_S
    made.bounced.tick(made.session, made.folder, idle, SHARES)
    while made.bounced._reading is not None:
        assert time.monotonic() < end
        time.sleep(0.001)
        made.bounced.tick(made.session, made.folder, idle, SHARES)


def test_what_a_store_has_is_shown_and_nothing_is_baked_unasked(made):
    made.held["samples"] = 64
    tick(made, idle=False)
    assert not made.given, "before direct light is there"
    tick(made)
    tick(made)
    assert made.given == [64] and made.bounced.samples == 64 and not made.bakes


def test_passes_are_shown_as_they_arrive(made):
    made.bounced.on = True
    tick(made)
    tick(made)
    assert [bake.bounces for bake in made.bakes] == [Wanted("64,1,1,1", 1024, tuple(NAMES[6:]))]
    assert made.bounced.busy and made.bounced.line == "baking"
    for samples in (16, 32):
        made.held["samples"] = made.bakes[0].samples = samples
        tick(made)
    assert made.given == [16, 32]
    made.held["samples"] = made.bakes[0].samples = 1024
    tick(made)
    made.bakes[0].running = False
    tick(made)
    tick(made)
    assert made.bounced.samples == 1024 and not made.bounced.busy and len(made.bakes) == 1
    made.bounced.wanted = 4096
    tick(made)
    assert made.bakes[1].bounces.samples == 4096, "more samples are added"


def test_another_series_begins_anew(made):
    made.bounced.on = True
    tick(made)
    tick(made)
    made.bounced.change("64,1,1,1")
    assert not made.bakes[0].closed
    made.bounced.change("64,16")
    tick(made)
    assert made.bakes[0].closed and made.bakes[1].bounces.series == "64,16"
    made.bounced.close()
    assert made.bakes[1].closed


def test_a_bake_that_fails_is_a_line_and_is_not_begun_again(made):
    made.bounced.on = True
    tick(made)
    tick(made)
    made.bakes[0].error, made.bakes[0].running = "no room on the disk", False
    tick(made)
    tick(made)
    assert made.bounced.trouble == "interreflections: no room on the disk" and len(made.bakes) == 1
    assert not made.bounced.on


def test_a_store_that_cannot_be_read_is_a_line(made, monkeypatch):
    def refuse(*_):
        raise UserError("chunk is damaged", file=Path("room"))

    made.held["samples"] = 64
    monkeypatch.setattr(interreflections, "interreflections", refuse)
    tick(made)
    assert "chunk is damaged" in made.bounced.trouble and not made.given
