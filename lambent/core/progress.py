"""Progress and cancellation, spoken by everything that takes more than a second.

Long work takes `progress: Progress = silent`. The command line shows a bar, the window a panel, tests nothing.
"""

from __future__ import annotations

from typing import Protocol


class Cancelled(Exception):
    """The user asked to stop; what was finished stays."""


class Progress(Protocol):
    """Called with the share done; may raise `Cancelled` (or KeyboardInterrupt) to stop the work."""

    def __call__(self, done: float, total: float, what: str) -> None: ...


def silent(done: float, total: float, what: str) -> None:
    """A `Progress` that shows nothing."""
