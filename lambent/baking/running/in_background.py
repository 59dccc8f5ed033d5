"""A background thread for ordered work: results are packed and written while the next ones are computed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

AHEAD = 32  # pieces of work that may queue


class Background:
    """Does one piece of work after another on its own thread; see `background`."""

    def __init__(self, thread: ThreadPoolExecutor) -> None:
        self._thread, self._waiting = thread, list[Future[Any]]()

    def do(self, work: Callable[..., Any], *arguments: Any) -> None:
        """Queue work after all previous work; raises the error of work that has failed."""
        if len(self._waiting) >= AHEAD:
            self._waiting.pop(0).result()
        self._waiting.append(self._thread.submit(work, *arguments))

    def finish(self) -> None:
        """Wait until all work is done."""
        while self._waiting:
            self._waiting.pop(0).result()


@contextmanager
def background() -> Iterator[Background]:
    """Completes all work on exit, even if the block raises an error."""
    with ThreadPoolExecutor(1) as thread:
        work = Background(thread)
        yield work
        work.finish()
