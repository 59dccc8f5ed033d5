"""One row of bench `card` in a process of its own: what it dies of, or takes too long at, costs only that row.

    python -m lambent.bench.card_rows.process ROW WORK < EFFORT

The effort is pickled; figures are lines of JSON behind `MARK`. The process ends when its input is closed, with the
bench that started it.
"""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from queue import Empty, Queue
from typing import Any

from lambent.baking.engine import VARIANT_VARIABLE
from lambent.bench.card_rows.row import Absent, Row
from lambent.core.errors import UserError
from lambent.core.machine import python_environment

MARK = "lambent-card "
TICK_S = 1.0  # between reports of the time left
_WORDS = 300


class Failed(Exception):
    """A row has no more figures; the message says why."""


def figures(name: str, row: Row, effort: object, work: Path, limit_s: float) -> Iterator[dict[str, Any] | None]:
    """Figures of a row as they come, and None about once a second.

    Raises
    ------
    Failed
        If the row fails, or takes more than `limit_s`.
    """
    end = time.monotonic() + limit_s
    with tempfile.TemporaryFile() as errors, _started(name, row, effort, work, errors) as process:
        lines: Queue[str | None] = Queue()
        threading.Thread(target=_read, args=(process, lines), daemon=True).start()
        while True:
            left = end - time.monotonic()
            if left <= 0:
                raise Failed(f"stopped after {limit_s:.0f} s")
            try:
                line = lines.get(timeout=min(TICK_S, left))
            except Empty:
                yield None
                continue
            if line is None:
                break
            if line.startswith(MARK):
                said = json.loads(line.removeprefix(MARK))
                if "reason" in said:
                    raise Failed(said["reason"])
                yield said
        if code := process.wait():
            errors.seek(0)
            words = errors.read().decode(errors="replace").strip().splitlines()[-1:]
            raise Failed(" ".join([f"ended with code {code}", *words])[:_WORDS])


@contextmanager
def _started(name: str, row: Row, effort: object, work: Path, errors: Any) -> Iterator[subprocess.Popen[bytes]]:
    environment = python_environment()
    if row.variant is not None:
        environment[VARIANT_VARIABLE] = row.variant
    process = subprocess.Popen(
        [sys.executable, "-m", __name__, name, str(work)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors,
        env=environment,
    )  # fmt: skip
    assert process.stdin is not None
    try:
        process.stdin.write(pickle.dumps(effort))
        process.stdin.flush()
        yield process
    finally:
        process.kill()
        process.wait()
        process.stdin.close()


def _read(process: subprocess.Popen[bytes], lines: Queue[str | None]) -> None:
    assert process.stdout is not None
    for line in process.stdout:
        lines.put(line.decode(errors="replace"))
    lines.put(None)


def main(name: str, work: str) -> None:
    """Measure a row and say its figures."""
    effort = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    from lambent.bench.card_rows.found import rows

    try:
        for figure in rows()[name].measure(effort, Path(work)):
            _say(asdict(figure))
    except (Absent, UserError) as error:
        _say({"reason": str(error)})


def _say(what: dict[str, Any]) -> None:
    sys.stdout.write(f"{MARK}{json.dumps(what)}\n")
    sys.stdout.flush()


def _end_with_parent() -> None:
    while os.read(0, 1):  # not by sys.stdin, whose lock the end of Python would wait for
        pass
    os._exit(1)


if __name__ == "__main__":
    main(*sys.argv[1:])
