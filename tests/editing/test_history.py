"""Undo, redo and strokes."""

from __future__ import annotations

from lambent.editing.session.history import History


def test_undo_and_redo_have_no_limit() -> None:
    history = History(0)
    for state in range(1, 5001):
        history.change(state)
    for state in reversed(range(5000)):
        history.undo()
        assert history.now == state
    assert not history.can_undo
    history.undo()
    for _ in range(5000):
        history.redo()
    assert (history.now, history.can_redo) == (5000, False)


def test_a_new_change_ends_what_could_be_redone() -> None:
    history = History("a")
    history.change("b")
    history.undo()
    history.change("c")
    assert not history.can_redo
    history.undo()
    assert history.now == "a"


def test_a_stroke_is_one_step() -> None:
    history = History(0)
    history.begin_stroke()
    for state in (1, 2, 3):
        history.restart_stroke()
        assert history.now == 0
        history.change(state)
    assert history.can_undo
    history.end_stroke()
    assert history.now == 3
    history.undo()
    assert (history.now, history.can_undo) == (0, False)


def test_undo_within_a_stroke_ends_it() -> None:
    history = History(0)
    history.begin_stroke()
    history.change(1)
    history.undo()
    assert history.now == 0
    history.redo()
    assert history.now == 1


def test_what_changes_nothing_is_no_step() -> None:
    history = History(0)
    history.change(0)
    history.begin_stroke()
    history.end_stroke()
    assert not history.can_undo
