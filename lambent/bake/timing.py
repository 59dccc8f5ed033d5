"""What the steps of a bake take, in seconds of wall clock."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Protocol

from lambent.store.contract import LAST_RUN, TIMINGS
from lambent.store.store import Store


class Timed(Protocol):
    """`with timed("reflectors"):` notes what a step takes."""

    def __call__(self, step: str, *, continued: bool = False) -> AbstractContextManager[None]: ...


def untimed(step: str, *, continued: bool = False) -> AbstractContextManager[None]:
    return nullcontext()


class Stopwatch:
    """Notes seconds in two documents of a store.

    "timings" has them by step; a step that continues an interrupted bake adds to those that are there. "last_run" has
    those of one run alone, with "other" for what is no step, so that they add up to the whole.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._steps: dict[str, float] = {}

    @contextmanager
    def __call__(self, step: str, *, continued: bool = False) -> Iterator[None]:
        start = time.perf_counter()
        before = self._store.documents.get(TIMINGS, {}).get(step, 0.0) if continued else 0.0
        try:
            yield
        finally:
            self._steps[step] = time.perf_counter() - start
            after = {**self._store.documents.get(TIMINGS, {}), step: round(before + self._steps[step], 3)}
            self._store.set_document(TIMINGS, after)

    def finish(self, start: float) -> None:
        """Write "last_run"; the run began at `start` of `time.perf_counter`."""
        other = time.perf_counter() - start - sum(self._steps.values())
        steps = {**self._steps, "other": other}
        self._store.set_document(LAST_RUN, {step: round(seconds, 3) for step, seconds in steps.items()})
