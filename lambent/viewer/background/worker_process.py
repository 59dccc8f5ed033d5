"""A background process that reports in lines: each line of its stdout is a JSON object.

A thread reads them. Requests are lines of JSON on its stdin, which closes with the window: a worker that reads to the
end cannot outlive the window.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from typing import IO, Any

from lambent.core.errors import UserError
from lambent.core.machine import python_environment
from lambent.core.progress import Progress
from lambent.viewer.background.work import Work, pending

LAST_CHARACTERS = 300  # kept end of the output before the process died
Take = Callable[[Mapping[str, Any], IO[bytes]], None]


class WorkerProcess:
    """A running worker, `python -m MODULE WORDS...`.

    Parameters
    ----------
    name : str
        Name of its task, for error lines.
    take : callable
        Called in the thread with each line and its stream; bytes may follow a line, fewer than the line says if the
        process ends. A line with "error" is not passed on: it ends the process and becomes its `error`.
    ends : bool
        Whether the worker ends by itself when it is done; if not, its end is an error.
    wake : callable
        Called in the thread after `take`, and when there is an end to handle.
    """

    def __init__(
        self, module: str, words: Sequence[str], name: str, take: Take, *, ends: bool,
        wake: Callable[[], None] = lambda: None,
    ) -> None:  # fmt: skip
        self.error = ""  # reason of a failure, in one line; else empty
        self._name, self._take, self._ends, self._wake = name, take, ends, wake
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 - as long as the process
        command = [sys.executable, "-m", module, *words]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log, env=python_environment()
        )
        self._work: Work | None = Work(self._listen, lambda _: None, self._failed, wake)

    @property
    def running(self) -> bool:
        """Whether the process runs; handles its end."""
        self._work = pending(self._work)
        return self._work is not None

    def ask(self, said: Mapping[str, Any] | Sequence[Any]) -> bool:
        """Send a line; return False if the process has ended."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(said).encode() + b"\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            return False  # `_listen` reports why
        return True

    def close(self) -> None:
        """Kill the process, and wait for its end."""
        if self._work is not None:
            self._work.cancel()
            self._process.kill()
            self._work.wait()
            self._work = None

    def _failed(self, error: UserError) -> None:
        self.error = str(error)

    def _listen(self, progress: Progress) -> None:
        """Read the output of the process until it ends."""
        process = self._process
        assert process.stdout is not None
        try:
            for line in iter(process.stdout.readline, b""):
                progress(0, 1, "")
                if not line.endswith(b"\n"):
                    break  # the process ended while it wrote
                said = json.loads(line)
                if "error" in said:
                    raise UserError(str(said["error"]))
                self._take(said, process.stdout)
                self._wake()
            code = process.wait()
        finally:
            process.kill()
            process.wait()
        progress(1, 1, "")  # raises after a cancel
        if code == 0 and self._ends:
            return
        self._log.seek(0)
        words = self._log.read().decode(errors="replace").strip()[-LAST_CHARACTERS:].splitlines()
        end = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with {code}"
        raise UserError(f"{self._name} {end} ({words[-1] if words else 'no message'})")
