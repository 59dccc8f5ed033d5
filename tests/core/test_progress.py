"""Progress of loops, of named steps, and of a step within longer work."""

from __future__ import annotations

import pytest

from lambent.core.progress import part_of, stepper, tracked


def record():
    seen = []
    return seen, lambda done, total, what: seen.append((done, total, what))


def test_every_item_and_the_end_are_reported():
    seen, progress = record()
    assert list(tracked("ab", progress, "letters")) == ["a", "b"]
    assert seen == [(0, 2, "letters"), (1, 2, "letters"), (2, 2, "letters")]


def test_steps_count_up_to_the_total():
    seen, progress = record()
    step = stepper(progress, 2)
    for what in ("first", "second", "done"):
        step(what)
    assert seen == [(0, 2, "first"), (1, 2, "second"), (2, 2, "done")]


def test_a_step_moves_the_whole_by_its_share() -> None:
    seen: list[tuple[float, str]] = []
    step = part_of(lambda done, total, what: seen.append((done / total, what)), 0.25, 0.75, "step")
    step(0, 8, "samples")
    step(4, 8, "samples")
    step(8, 8, "samples")
    step(0, 0, "nothing to do")
    assert [share for share, _ in seen] == pytest.approx([0.25, 0.5, 0.75, 0.25])
    assert {what for _, what in seen} == {"step"}
