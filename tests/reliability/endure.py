"""Processes killed at random moments while they write: bakes, saves of a session, exports.

    python -m tests.reliability.endure --minutes 15 --out endured.json

A round copies a prepared folder, kills one to seven processes after random parts of the time that an undisturbed one
takes, and checks after each kill that what is left can be used. Then a last process runs undisturbed, and its result
must equal, bit for bit, that of one that was never disturbed. `--job NAME` restricts it.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tests.reliability.endured import JOBS, copied

_PROCESSES = multiprocessing.get_context("forkserver")  # of what is imported; Dr.Jit begins in each process anew
_PROCESSES.set_forkserver_preload(["tests.reliability.endured"])
MOST_KILLS = 7  # of a round


@dataclass
class Result:
    """Rounds, kills, and processes that had ended before their kill, by job; failures by job and what was said."""

    rounds: Counter[str] = field(default_factory=Counter)
    kills: Counter[str] = field(default_factory=Counter)
    too_late: Counter[str] = field(default_factory=Counter)
    failures: dict[str, str] = field(default_factory=dict)


class Endurance:
    """One job's prepared folder and undisturbed result, and rounds of kills."""

    def __init__(self, name: str, folder: Path) -> None:
        self._name, self._folder, self._job = name, folder / name, JOBS[name]
        self._folder.mkdir(parents=True)
        self._start, self._copy = self._folder / "start", self._folder / "copy"
        self._start.mkdir()
        self._finish(self._job.prepare, self._start)
        copied(self._start, self._copy)
        self._finish(self._job.work, self._copy)  # compiles what is compiled once
        copied(self._start, self._copy)
        self._lasts_s = self._finish(self._job.work, self._copy)
        self.whole = self._job.content(self._copy)

    def round(self, random: np.random.Generator, result: Result) -> None:
        """Kill processes, check what they left, and let one finish; raises what a check raises."""
        copied(self._start, self._copy)
        for _ in range(random.integers(1, MOST_KILLS + 1)):
            if killed(self._job.work, self._copy, random.uniform(0, self._lasts_s)):
                result.kills[self._name] += 1
            else:
                result.too_late[self._name] += 1
            self._job.check(self._copy)
        self._finish(self._job.work, self._copy)
        found = self._job.content(self._copy)
        different = [name for name in {*found, *self.whole} if found.get(name) != self.whole.get(name)]
        assert not different, f"differ from an undisturbed run: {sorted(different)}"
        result.rounds[self._name] += 1

    @staticmethod
    def _finish(work: Callable[[Path], object], folder: Path) -> float:
        """Run undisturbed; returns the seconds that the work took."""
        process, started = _begun(work, folder)
        process.join()
        if process.exitcode != 0:
            raise AssertionError(f"{work} ended with {process.exitcode}")
        return time.monotonic() - started


def killed(work: Callable[[Path], object], folder: Path, after_s: float) -> bool:
    """Whether a process that works on a folder still ran after so many seconds; it was killed then."""
    process, _ = _begun(work, folder)
    process.join(after_s)
    alive = process.exitcode is None
    process.kill()
    process.join()
    return alive


def _begun(work: Callable[[Path], object], folder: Path) -> tuple[multiprocessing.process.BaseProcess, float]:
    """A process that has imported everything, and the moment when its work begins."""
    ready, theirs = _PROCESSES.Pipe(duplex=False)
    process = _PROCESSES.Process(target=_run, args=(work, folder, theirs))
    process.start()
    theirs.close()
    ready.recv()
    return process, time.monotonic()


def _run(work: Callable[[Path], object], folder: Path, ready: object) -> None:
    ready.send(None)  # type: ignore[attr-defined]
    work(folder)
    os._exit(0)  # an engine's threads and device need no orderly end, and a kill gives none


def run(folder: Path, jobs: list[str], seed: int, rounds: int, until_s: float) -> Result:
    """`rounds` of every job in turn, none begun after `until_s` of the monotonic clock."""
    result = Result()
    endured = {name: Endurance(name, folder) for name in jobs}
    for number in range(rounds):
        for name, one in endured.items():
            if time.monotonic() >= until_s:
                return result
            random = np.random.default_rng([seed, number, sorted(JOBS).index(name)])
            try:
                one.round(random, result)
            except Exception as error:  # noqa: BLE001 - every kind of failure is what this looks for
                result.failures[f"{name} {number}"] = "".join(traceback.format_exception_only(error)).strip()
    return result


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--minutes", type=float, default=15.0)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--job", choices=sorted(JOBS))
    options.add_argument("--out", type=Path, help="JSON file of the counts")
    given = options.parse_args()
    jobs = [given.job] if given.job else list(JOBS)
    with tempfile.TemporaryDirectory() as folder:
        result = run(Path(folder), jobs, given.seed, sys.maxsize, time.monotonic() + 60 * given.minutes)
    text = json.dumps({name: value for name, value in vars(result).items()}, indent=1)
    print(text)  # noqa: T201
    if given.out is not None:
        given.out.write_text(text)
    sys.exit(bool(result.failures))


if __name__ == "__main__":
    main()
