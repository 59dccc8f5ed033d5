"""Work in order behind the main thread: packing and writing what was computed while the next is being computed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

AHEAD = 32  # pieces of work that may wait


class Behind:
    """Does one piece of work after another on a thread of its own; see `behind`."""

    def __init__(self, thread: ThreadPoolExecutor) -> None:
        self._thread, self._waiting = thread, list[Future[Any]]()

    def do(self, work: Callable[..., Any], *arguments: Any) -> None:
        """Do work after all that was given before; raises the error of work that has failed."""
        if len(self._waiting) >= AHEAD:
            self._waiting.pop(0).result()
        self._waiting.append(self._thread.submit(work, *arguments))

    def finish(self) -> None:
        """Wait until all is done."""
        while self._waiting:
            self._waiting.pop(0).result()


@contextmanager
def behind() -> Iterator[Behind]:
    """Everything is done at the end, even where the block raises an error."""
    with ThreadPoolExecutor(1) as thread:
        work = Behind(thread)
        yield work
        work.finish()
