"""Progress of long work: a bar with the time left in a terminal and a notebook, else a line for each step."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from typing import Any

from lambent.core.interruption import was_interrupted
from lambent.core.plain import printable
from lambent.core.progress import Progress, silent

Wanted = bool | Progress | None  # None: in a terminal or a notebook


@contextmanager
def progress_of(wanted: Wanted) -> Iterator[Progress]:
    """The `Progress` that a caller wants: their own, a bar or lines on stderr, or none."""
    if callable(wanted):
        yield wanted
    elif wanted or (wanted is None and (_in_notebook() or sys.stderr.isatty())):
        with progress_bar() as progress:
            yield progress
    else:
        yield silent


def _in_notebook() -> bool:
    return "ipykernel" in sys.modules


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """A bar with the time left on stderr; in a notebook one in the cell, else a line for each step with its time.

    Raises `KeyboardInterrupt` at the next step if a library has dropped the one of Ctrl-C.
    """
    if not sys.stderr.isatty():
        lines = CellBar() if _in_notebook() else StepLines()
        try:
            yield _interruptible(lines)
        except BaseException:
            lines.end("stopped after ")
            raise
        lines.end()
        return
    from rich.console import Console
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bars

    console = Console(stderr=True)
    columns = TextColumn("{task.description}", markup=False), BarColumn(), TaskProgressColumn(), TimeRemainingColumn()
    with Bars(*columns, console=console, transient=True) as bars:
        tasks: dict[str, Any] = {}

        def update(done: float, total: float, what: str) -> None:
            if what not in tasks:
                for other in tasks.values():
                    bars.update(other, visible=False)
                tasks[what] = bars.add_task(printable(what), total=total)
            bars.update(tasks[what], completed=done, total=total, visible=True)

        yield _interruptible(update)


def _interruptible(progress: Progress) -> Progress:
    def report(done: float, total: float, what: str) -> None:
        if was_interrupted():
            raise KeyboardInterrupt
        progress(done, total, what)

    return report


def _say(text: str) -> None:
    sys.stderr.write(printable(text) + "\n")


class StepLines:
    """Prints a line on stderr for each step longer than half a second, and one per minute during a step."""

    SHORTEST_S = 0.5
    STILL_S = 60.0

    def __init__(self) -> None:
        self.step = ""
        self.begun = self.said = time.monotonic()

    def __call__(self, done: float, total: float, what: str) -> None:
        now = time.monotonic()
        if what != self.step:
            self.end()
            self.step, self.begun, self.said = what, now, now
        elif now - self.said >= self.STILL_S:
            self.said = now
            _say(f"{what}: {min(done / max(total, 1e-9), 1):.0%} after {now - self.begun:.0f} s")

    def end(self, outcome: str = "") -> None:
        """Print the time of the current step, if there is one."""
        seconds = time.monotonic() - self.begun
        if self.step and seconds >= self.SHORTEST_S:
            _say(f"{self.step}: {outcome}{seconds:.1f} s")
        self.step = ""


class CellBar:
    """One line in the cell of a notebook, for work of more than half a second: a bar, then the time it took."""

    EVERY_S = 0.2

    def __init__(self) -> None:
        self.begun = self.said = time.monotonic()
        self.shown: Any = None  # IPython's handle of the line

    def __call__(self, done: float, total: float, what: str) -> None:
        now, share = time.monotonic(), min(done / max(total, 1e-9), 1)
        if now - self.said >= (StepLines.SHORTEST_S if self.shown is None else self.EVERY_S):
            self.said = now
            self._show(f"{what}: {share:.0%}, {now - self.begun:.0f} s", f"<progress value={share:.3f}></progress> ")

    def end(self, outcome: str = "") -> None:
        if self.shown is not None:
            self._show(f"{outcome}{time.monotonic() - self.begun:.1f} s")

    def _show(self, text: str, bar: str = "") -> None:
        from IPython.display import display

        line = {"text/plain": printable(text), "text/html": f"<small>{bar}{escape(printable(text))}</small>"}
        if self.shown is None:
            self.shown = display(line, raw=True, display_id=True)  # type: ignore[no-untyped-call]
        else:
            self.shown.update(line, raw=True)
