"""Edits of a session as strokes: one drag is one step of undo, and an error is one line of text."""

from __future__ import annotations

from collections.abc import Callable

from lambent.core.errors import UserError
from lambent.editing.session.document import SessionDocument
from lambent.editing.session.session import Session


class Strokes:
    """Edits a session for a panel.

    Attributes
    ----------
    message
        Error of the last edit; empty without one.
    """

    def __init__(self) -> None:
        self.message = ""
        self._left: SessionDocument | None = None  # the state after the last edit of the open stroke

    def once(self, session: Session, act: Callable[[], object]) -> None:
        """Make an edit as one step of undo."""
        self.end(session)
        self.message = ""
        try:
            with session.stroke():
                act()
        except UserError as error:
            self.message = str(error)

    def replace(self, session: Session, act: Callable[[], object]) -> None:
        """Repeat the open stroke from the state before it, or open one.

        A failing edit keeps the state of the stroke.
        """
        history = session.history
        if not self.is_open(session):
            history.begin_stroke()
        before, self.message = history.now, ""
        history.restart_stroke()
        try:
            act()
        except UserError as error:
            history.change(before)
            self.message = str(error)
        self._left = history.now

    def is_open(self, session: Session) -> bool:
        """Whether a stroke is open; an undo or an edit from elsewhere ends it."""
        return self._left is not None and self._left is session.document

    def has_left(self, session: Session) -> bool:
        """Whether the session was changed from elsewhere while a stroke was open."""
        return self._left is not None and not self.is_open(session)

    def end(self, session: Session) -> None:
        if self.is_open(session):
            session.history.end_stroke()
        self._left = None
