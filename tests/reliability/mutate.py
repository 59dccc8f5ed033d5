"""Broken files for every reader of the project, in one process, and the table of what happened.

    python -m tests.reliability.mutate --count 100000 --out mutations.json

A broken file is read and used, or refused in one line by a `UserError`, within `LONGEST_S` of the processor and
`MOST_BYTES` of memory above what the process had. Mutation N of a seed is always the same:
`--first N --count 1 --seed S` repeats it alone.
"""

from __future__ import annotations

import argparse
import faulthandler
import json
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from lambent.core.errors import UserError
from lambent.core.inputs import UNREADABLE
from tests.reliability.mutations import mutate
from tests.reliability.readers import Sound, numbers_of, sound

LONGEST_S = 10.0
MOST_BYTES = 2 << 30
IN_MEMORY = Path("/dev/shm")
STATUS, CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")


class Hang(BaseException):
    """A file took too long; no `except Exception` hides it."""


@dataclass
class Count:
    """What happened to the files of one reader."""

    tried: int = 0
    refused: int = 0
    read: int = 0
    failed: int = 0
    slowest_s: float = 0.0
    peak_mb: float = 0.0


@dataclass
class Result:
    """Counts by reader, and how often each kind of failure was met."""

    counts: dict[str, Count] = field(default_factory=dict)
    failures: dict[str, int] = field(default_factory=dict)


class Bench:
    """Folders of sound files, one of which is broken while it is used."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._laid_out: dict[int, Path] = {}

    def lay_out(self, one: Sound) -> Path:
        """The folder of a sound file, with all its files whole."""
        if id(one) not in self._laid_out:
            folder = self._laid_out[id(one)] = self._folder / str(len(self._laid_out))
            for name, content in one.files.items():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                (folder / name).write_bytes(content)
        return self._laid_out[id(one)]

    def use(self, one: Sound, content: bytes) -> str:
        """The text of the `UserError` for a broken file, or "" where it could be used; anything else is raised."""
        folder = self.lay_out(one)
        path, broken = folder / one.main, folder / one.broken
        broken.write_bytes(content)
        try:
            with within(LONGEST_S):
                one.use(path)
        except UserError as error:
            said = str(error)
            assert "\n" not in said and "\r" not in said, "an error of several lines"
            return said
        finally:
            broken.write_bytes(one.files[one.broken])
        return ""


@contextmanager
def within(seconds: float) -> Iterator[None]:
    """`Hang` after so many seconds of the processor, or six times as many on the clock."""

    def stop(*_: object) -> None:
        raise Hang(f"longer than {seconds} s")

    timers = {signal.SIGPROF: (signal.ITIMER_PROF, seconds), signal.SIGALRM: (signal.ITIMER_REAL, 6 * seconds)}
    before = {number: signal.signal(number, stop) for number in timers}
    for timer, limit_s in timers.values():
        signal.setitimer(timer, limit_s)
    try:
        yield
    finally:
        for number, (timer, _) in timers.items():
            signal.setitimer(timer, 0)
            signal.signal(number, before[number])


@contextmanager
def bounded(most_bytes: int) -> Iterator[None]:
    """No more memory than the process has now and `most_bytes`: beyond, allocations fail."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    now = int(next(line for line in STATUS.read_text().splitlines() if line.startswith("VmSize")).split()[1]) << 10
    resource.setrlimit(resource.RLIMIT_AS, (now + most_bytes, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


def run(
    folder: Path, first: int, count: int, seed: int, reader: str = "", out: Path | None = None, keep: Path | None = None
) -> Result:
    """Mutations `first` to `first + count` of a seed, over the readers whose name holds `reader`."""
    folders = [sound()[k] for k in numbers_of(reader, sound())]
    bench, result = Bench(folder), Result()
    others = [one.files[one.broken] for one in sound()]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for one in folders:  # imports and caches are warm, and every sound file can be used
            said = bench.use(one, one.files[one.broken])
            assert not said, f"{one.reader}: {said}"
        with bounded(MOST_BYTES):
            for number in range(first, first + count):
                if number % 100 == 0:  # code that never returns to Python ends the process with its stack
                    faulthandler.dump_traceback_later(100 * LONGEST_S, exit=True)
                one = folders[number % len(folders)]
                random = np.random.default_rng([seed, number])
                content = mutate(one.files[one.broken], others, random)
                before = _memory()
                attempt(bench, one, content, result, keep, str(number))
                counted = result.counts[one.reader]
                counted.peak_mb = max(counted.peak_mb, (_memory("VmHWM") - before) / 2**20)
                if out is not None and (number % 1000 == 0 or number == first + count - 1):
                    out.write_text(json.dumps(asdict(result), indent=1))
    faulthandler.cancel_dump_traceback_later()
    return result


def attempt(bench: Bench, one: Sound, content: bytes, result: Result, keep: Path | None, number: str) -> str:
    """Use a broken file and count what happens: what was said of it, "" where it could be used."""
    counted = result.counts.setdefault(one.reader, Count())
    counted.tried += 1
    said = ""
    start = time.process_time()
    try:
        said = bench.use(one, content)
        counted.refused += bool(said)
        counted.read += not said
        assert UNREADABLE not in said, said  # the net below the readers
    except (Exception, Hang) as error:  # noqa: BLE001 - every kind of failure is what this looks for
        counted.failed += 1
        frames = [f for f in traceback.extract_tb(error.__traceback__) if "lambent/" in f.filename]
        where = f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "here"
        key = said = f"{one.reader}: {type(error).__name__} at {where}: {ascii(str(error))[:100]}"
        if key not in result.failures:
            print(f"{number}: {key}", flush=True)  # noqa: T201
            if keep is not None:
                keep.mkdir(parents=True, exist_ok=True)
                (keep / f"{number}-{Path(one.broken).name}").write_bytes(content)
        result.failures[key] = result.failures.get(key, 0) + 1
    counted.slowest_s = max(counted.slowest_s, time.process_time() - start)
    return said


def _memory(which: str = "VmRSS") -> int:
    """Bytes that the process has, or, for VmHWM, has had since the last call for what it has."""
    if which == "VmRSS":
        CLEAR.write_text("5")
    return int(next(line for line in STATUS.read_text().splitlines() if line.startswith(which)).split()[1]) << 10


def table(result: Result) -> str:
    """The counts as Markdown."""
    rows = ["| reader | mutations | refused | read | slowest | peak memory |", "|---|---|---|---|---|---|"]
    counts = dict(sorted(result.counts.items(), key=lambda item: item[0].lower()))
    for name, c in counts.items():
        figures = f"{c.tried:,} | {c.refused:,} | {c.read:,} | {c.slowest_s:.2f} s | {c.peak_mb:.0f} MB"
        rows.append(f"| {name} | {figures} |")
    c = Count(*(sum(getattr(c, name) for c in counts.values()) for name in ("tried", "refused", "read")))
    slowest, peak = (max((getattr(c, name) for c in counts.values()), default=0) for name in ("slowest_s", "peak_mb"))
    rows.append(f"| all | {c.tried:,} | {c.refused:,} | {c.read:,} | {slowest:.2f} s | {peak:.0f} MB |")
    return "\n".join(rows)


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--count", type=int, default=1000)
    options.add_argument("--first", type=int, default=0)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--reader", default="")
    options.add_argument("--out", type=Path, help="JSON file of the counts, written as they grow")
    options.add_argument("--keep", type=Path, help="folder for a file of every failure")
    given = options.parse_args()
    faulthandler.enable()
    with tempfile.TemporaryDirectory(dir=IN_MEMORY if IN_MEMORY.is_dir() else None) as folder:
        result = run(Path(folder), given.first, given.count, given.seed, given.reader, given.out, given.keep)
    print(table(result))  # noqa: T201
    for key, times in result.failures.items():
        print(f"{times} x {key}")  # noqa: T201
    sys.exit(bool(result.failures))


if __name__ == "__main__":
    main()
