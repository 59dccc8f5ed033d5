"""Duration of the steps of a bake, in seconds of wall time, and of processor time in this process."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Protocol

from lambent.store.contract import LAST_RUN, PROCESSOR_TIMINGS, TIMINGS
from lambent.store.store import Store


class Timed(Protocol):
    """`with timed("reflectors"):` times a step."""

    def __call__(self, step: str, *, continued: bool = False) -> AbstractContextManager[None]: ...


def untimed(step: str, *, continued: bool = False) -> AbstractContextManager[None]:
    return nullcontext()


class Stopwatch:
    """Stores durations in seconds in documents of a store.

    "timings" has wall time by step; a step that continues an interrupted bake adds to the previous value. "last_run"
    has that of a single run, with "other" for the remainder, so that it sums to the whole run. "processor_timings" has
    processor time by step, summed over cores, which other work on the machine affects less.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._steps: dict[str, float] = {}

    @contextmanager
    def __call__(self, step: str, *, continued: bool = False) -> Iterator[None]:
        start, of_cores = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            self._steps[step] = time.perf_counter() - start
            took = {TIMINGS: self._steps[step], PROCESSOR_TIMINGS: time.process_time() - of_cores}
            for document, seconds in took.items():
                noted = self._store.documents.get(document, {})
                before = noted.get(step, 0.0) if continued else 0.0
                self._store.set_document(document, {**noted, step: round(before + seconds, 3)})

    def finish(self, start: float) -> None:
        """Write "last_run"; `start` is the run's start by `time.perf_counter`."""
        other = time.perf_counter() - start - sum(self._steps.values())
        steps = {**self._steps, "other": other}
        self._store.set_document(LAST_RUN, {step: round(seconds, 3) for step, seconds in steps.items()})
