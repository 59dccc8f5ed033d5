"""Unlimited undo and redo. States are frozen and share everything unchanged, so that a step costs little memory."""

from __future__ import annotations

from typing import Generic, Protocol, TypeVar

State = TypeVar("State")


class Steps(Protocol[State]):
    """A state and the steps from and to it, as of `History`."""

    @property
    def now(self) -> State: ...
    def change(self, state: State) -> None: ...
    def begin_stroke(self) -> None: ...
    def restart_stroke(self) -> None: ...
    def end_stroke(self) -> None: ...
    @property
    def can_undo(self) -> bool: ...
    @property
    def can_redo(self) -> bool: ...
    def undo(self) -> None: ...
    def redo(self) -> None: ...


class History(Generic[State]):
    """A state and its predecessors. A stroke groups the changes of one drag, to be undone together.

    Attributes
    ----------
    now
        The current state.
    """

    def __init__(self, state: State) -> None:
        self.now = state
        self._past: list[State] = []
        self._future: list[State] = []
        self._stroke: list[State] = []  # the state before the open stroke

    def change(self, state: State) -> None:
        """Go to `state`, as a step of its own or as part of the open stroke."""
        if self._stroke:
            self.now = state
        else:
            self._step(self.now, state)

    def begin_stroke(self) -> None:
        self.end_stroke()
        self._stroke = [self.now]

    def restart_stroke(self) -> None:
        """Return to the state before the open stroke, from which the next move of a drag starts."""
        if self._stroke:
            self.now = self._stroke[0]

    def end_stroke(self) -> None:
        for before in self._stroke:
            self._step(before, self.now)
        self._stroke = []

    def _step(self, before: State, after: State) -> None:
        self.now = after
        if after != before:
            self._past.append(before)
            self._future.clear()

    @property
    def in_stroke(self) -> bool:
        return bool(self._stroke)

    @property
    def previous(self) -> State | None:
        """The state before the open stroke, else before the last step; None if there is none."""
        return next(iter(self._stroke or self._past[-1:]), None)

    @property
    def can_undo(self) -> bool:
        return bool(self._past) or any(before != self.now for before in self._stroke)

    @property
    def can_redo(self) -> bool:
        return bool(self._future)

    def undo(self) -> None:
        self.end_stroke()
        if self._past:
            self._future.append(self.now)
            self.now = self._past.pop()

    def redo(self) -> None:
        self.end_stroke()
        if self._future:
            self._past.append(self.now)
            self.now = self._future.pop()
