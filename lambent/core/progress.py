"""Progress and cancellation of all work that takes more than a second.

Long work takes `progress: Progress = silent`. The command line shows a bar, the window a panel, tests show nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Protocol, TypeVar

T = TypeVar("T")


class Cancelled(Exception):
    """The user asked to stop; finished results stay."""


class Progress(Protocol):
    """Called with the amount done; may raise `Cancelled` (or KeyboardInterrupt) to stop the work."""

    def __call__(self, done: float, total: float, what: str) -> None: ...


def silent(done: float, total: float, what: str) -> None:
    """A `Progress` that shows nothing."""


def tracked(items: Sequence[T], progress: Progress, what: str) -> Iterator[T]:
    """Yield the items and report each to `progress` when it is taken; report the end too."""
    for done, item in enumerate(items):
        progress(done, len(items), what)
        yield item
    progress(len(items), len(items), what)


def stepper(progress: Progress, total: int) -> Callable[[str], None]:
    """A function that reports the next of `total` steps by name; the call after the last step reports the end."""
    done = iter(range(total + 1))
    return lambda what: progress(next(done), total, what)


def part_of(progress: Progress, begin: float, end: float, step: str) -> Progress:
    """A `Progress` for one step of longer work; it advances `progress` from the share `begin` to the share `end`."""

    def report(done: float, total: float, what: str) -> None:
        progress(begin + (end - begin) * done / max(total, 1), 1.0, step)

    return report
