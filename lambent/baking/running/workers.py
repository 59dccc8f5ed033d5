"""Execution of jobs: one after another in this process, or in other processes (`cluster`)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol, TypeVar

J = TypeVar("J")
R = TypeVar("R")


class Workers(Protocol):
    """Runs self-contained jobs, with equal results in any process and any order.

    `apart`: in other processes, so that jobs and results travel, and few large ones cost less than many small ones.
    """

    apart: bool

    def each(self, work: Callable[[J], R], jobs: Iterable[J]) -> Iterator[tuple[J, R]]:
        """Yield jobs with their results, in order of completion.

        `work` and the jobs must be picklable; jobs are created on demand, to have their arrays in memory only then.
        """


class InProcess:
    """Runs jobs in this process, in order."""

    apart = False

    def each(self, work: Callable[[J], R], jobs: Iterable[J]) -> Iterator[tuple[J, R]]:
        return ((job, work(job)) for job in jobs)
