"""Where jobs are done: one after another in this process, or in others (`cluster`)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol, TypeVar

J = TypeVar("J")
R = TypeVar("R")


class Workers(Protocol):
    """Does jobs that depend on nothing but themselves, so that any process, in any order, finds the same."""

    def each(self, work: Callable[[J], R], jobs: Iterable[J]) -> Iterator[tuple[J, R]]:
        """Jobs and their results, as they are done. `work` and the jobs can be pickled; jobs are made when their turn
        comes, so that their arrays are in memory only then."""


class InProcess:
    """Does jobs here, in their order."""

    def each(self, work: Callable[[J], R], jobs: Iterable[J]) -> Iterator[tuple[J, R]]:
        return ((job, work(job)) for job in jobs)
