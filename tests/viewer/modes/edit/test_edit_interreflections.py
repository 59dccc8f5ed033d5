"""Interreflections beside the window: when they are baked, read, taken away and begun anew. No bake is run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lambent.baking.interreflection.proposal import Proposal, Row
from lambent.baking.interreflection.settings import Bounces
from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.editing.session.session import Session
from lambent.materials.document import Material
from lambent.viewer.modes.edit import interreflections
from lambent.viewer.modes.edit.interreflections import Bounced
from tests.viewer.edited_view import tint
from tests.viewer.waiting import until

NAMES = [f"material {k}" for k in range(8)]
SMALL = frozenset(NAMES[6:])


def proposed(bounces: Bounces) -> Proposal:
    """Two materials are fixed where none was chosen."""
    fixed = bounces.fixed or SMALL
    rows = tuple(Row(name, "fixed" if name in fixed else "edited", 10, 0.1, 0.2) for name in NAMES)
    return Proposal(replace(bounces, fixed=fixed), rows, {}, {}, 1000, 2000)


class Bake:
    """A bake that a test drives."""

    def __init__(self, session, folder, bounces, proposing=None):
        self.bounces, self.kept, self.samples, self.proposal = bounces, proposing, 0, None
        self.running, self.error, self.line, self.closed = True, "", "baking", False

    def close(self):
        self.closed, self.running = True, False


@pytest.fixture
def made(monkeypatch, tmp_path):
    """Interreflections of a store that has `made.held` samples, the bakes that were begun, what the painter got."""
    held = {"samples": 0, "series": (64, 1, 1, 1), "edited": NAMES[:6]}
    bakes, asked, given = [], [], []

    def light(held):
        slots = tuple((name, "reflection") for name in held["edited"])
        return SimpleNamespace(samples=held["samples"], tails=SimpleNamespace(slots=(*slots, ("", "fixed"))))

    monkeypatch.setattr(interreflections, "samples_of", lambda store, session: held["samples"])
    monkeypatch.setattr(interreflections, "interreflections", lambda *_: light(held))
    monkeypatch.setattr(interreflections, "series_of", lambda *_: held["series"])
    monkeypatch.setattr(interreflections, "light_of", lambda light, _: np.full((3, 4), 1 + 1 / light.samples))
    monkeypatch.setattr(interreflections, "noted_noise", lambda *_: held.get("noted"))
    monkeypatch.setattr(interreflections.Store, "open", lambda folder: None)
    painter = SimpleNamespace(run=lambda task: task(), give=given.append)

    def bake(*words, **more):
        made = Bake(*words, **more)
        (bakes if made.kept is None else asked).append(made)
        return made

    (tmp_path / "manifest.json").touch()
    session = Session.new("room", Camera("front", (0, 0, 1), (0, 0, 0)), {name: Material(kd=0.5) for name in NAMES})
    return SimpleNamespace(
        bounced=Bounced(painter, bake), session=session, folder=tmp_path, held=held, bakes=bakes, given=given,
        asked=asked,
    )  # fmt: skip


def tick(made, idle=True):
    """Until nothing is read."""
    made.bounced.tick(made.session, made.folder, idle)
    until(lambda: made.bounced._reading is None, lambda: made.bounced.tick(made.session, made.folder, idle))


def answer(made):
    """Let the last proposal that was asked for arrive."""
    made.asked[-1].proposal, made.asked[-1].running = proposed(made.asked[-1].bounces), False
    tick(made)


def begun(made):
    """A bake of what was proposed."""
    tick(made)
    tick(made)
    answer(made)
    made.bounced.start()
    tick(made)
    return made.bakes[-1]


def test_what_a_store_has_is_shown_and_nothing_is_baked_unasked(made):
    made.held.update(samples=64, series=(16, 8, 1), edited=NAMES[:3])
    tick(made, idle=False)
    assert not made.given, "before direct light is there"
    tick(made)
    tick(made)
    assert [light.samples for light in made.given] == [64] and made.bounced.samples == 64 and not made.bakes
    assert made.bounced.series == "16,8,1" and made.bounced.fixed == {*NAMES[3:]}, "as in the store"
    assert made.asked[0].bounces == Bounces((16, 8, 1), 1024, frozenset(NAMES[3:]))
    assert set(made.asked[0].kept) == {*NAMES[:3]}, "what it takes to go on"


def test_the_noise_of_a_finished_store_is_shown_at_once(made):
    made.held.update(samples=64, noted=0.031)
    tick(made)
    tick(made)
    assert made.bounced.samples == 64 and made.bounced.noise == 0.031


def test_a_proposal_is_there_before_the_bake_and_can_be_changed(made):
    tint(made.session, NAMES[7], 1.8)
    made.bounced.start()
    tick(made)
    tick(made)
    assert made.asked[0].kept == {NAMES[7]} and made.bounced.fixed is None and not made.bakes, "it waits"
    made.bounced.stop()
    answer(made)
    assert made.bounced.fixed == SMALL and made.bounced.is_measured
    tick(made)
    assert len(made.asked) == 1, "measured once"
    made.bounced.choose(NAMES[0], False)
    assert not made.bounced.is_measured
    tick(made)
    assert made.asked[1].bounces.fixed == {NAMES[0], *SMALL} and NAMES[1] in made.asked[1].kept
    made.bounced.choose(NAMES[6], True)
    tick(made)
    assert made.asked[1].closed and made.asked[2].bounces.fixed == {NAMES[0], NAMES[7]}
    made.bounced.start()
    tick(made)
    assert made.asked[2].closed and made.bakes[0].bounces.fixed == {NAMES[0], NAMES[7]}, "what the user chose is baked"


def test_a_proposal_that_fails_is_a_line_and_is_not_asked_for_again(made):
    tick(made)
    tick(made)
    made.asked[0].error, made.asked[0].running = "the view shows no surface", False
    for _ in range(3):
        tick(made)
    assert made.bounced.trouble == "interreflections: the view shows no surface" and len(made.asked) == 1


def test_passes_are_shown_as_they_arrive_with_their_noise(made):
    bake = begun(made)
    assert bake.bounces == Bounces((64, 1, 1, 1), 1024, SMALL)
    assert made.bounced.busy and made.bounced.line == "baking"
    for samples in (16, 32):
        made.held["samples"] = bake.samples = samples
        tick(made)
    assert [light.samples for light in made.given] == [16, 32]
    assert made.bounced.noise == pytest.approx((1 / 16 - 1 / 32) / (1 + 1 / 32))
    made.held["samples"] = bake.samples = 1024
    tick(made)
    bake.running = False
    tick(made)
    tick(made)
    assert made.bounced.samples == 1024 and made.bounced.baking is None and len(made.bakes) == 1
    assert not made.bounced.on, "done"
    made.bounced.wanted = 4096
    made.bounced.start()
    tick(made)
    assert made.bakes[1].bounces.samples == 4096, "more samples are added"


def test_stop_and_continue(made):
    bake = begun(made)
    made.held["samples"] = bake.samples = 16
    tick(made)
    made.bounced.stop()
    tick(made)
    assert bake.closed and made.bounced.samples == 16 and len(made.bakes) == 1
    made.bounced.start()
    tick(made)
    assert len(made.bakes) == 2 and made.bakes[1].bounces == bake.bounces


def test_another_series_begins_anew(made):
    bake = begun(made)
    made.bounced.change("64,1,1,1")
    assert not bake.closed
    made.bounced.change("64,16")
    tick(made)
    assert bake.closed and made.asked[-1].bounces.series == (64, 16) and len(made.bakes) == 1
    answer(made)
    tick(made)
    assert made.bakes[1].bounces.series == (64, 16)
    made.bounced.close()
    assert made.bakes[1].closed


def test_a_bake_that_fails_is_a_line_and_is_not_begun_again(made):
    begun(made)
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
