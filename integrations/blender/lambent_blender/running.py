"""Lambent's command as background processes: Blender stays usable, and shows their last line."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import threading

STOPPED = "stopped; finished work stays, and the next bake continues"


def command_of(preference):
    """The words of the command in the preferences: a program on PATH, a path, or a command with arguments."""
    return [preference] if os.path.exists(preference) else shlex.split(preference, posix=os.name != "nt")


class Job:
    """Commands (name, words) one after the other; each begins when the one before it has ended well.

    `line` is what the running one said last, with the event `said`; `state` is running, done, failed or stopped.
    """

    def __init__(self, steps):
        self._steps, self.line, self.state, self.said = list(steps), "", "running", threading.Event()
        self._next()

    def poll(self):
        """Go on if a command has ended; whether anything still runs."""
        if self.state == "running" and self.process.poll() is not None:
            self._reader.join()
            if self.process.returncode:
                self.state = "failed"
                self.line = self.line or f"{self.words[0]} ended with code {self.process.returncode}"
            elif self._steps:
                self._next()
            else:
                self.state = "done"
        return self.state == "running"

    def cancel(self):
        """Interrupt the running command as Ctrl-C does; those after it do not begin."""
        if self.state == "running":
            self._steps.clear()
            self.process.send_signal(signal.CTRL_BREAK_EVENT if os.name == "nt" else signal.SIGINT)
            self.state, self.line = "stopped", STOPPED

    def _next(self):
        self.step, self.words = self._steps.pop(0)
        try:
            self.process = _started(self.words)
        except RuntimeError as error:
            self.state, self.line = "failed", str(error)
            return
        self._reader = threading.Thread(target=self._read, args=(self.process.stderr,), daemon=True)
        self._reader.start()

    def _read(self, stream):
        for line in stream:
            if line.strip() and self.state != "stopped":
                self.line = line.strip()
                self.said.set()


def call(words):
    """Run a short command to its end; RuntimeError with its last line if it fails."""
    process = _started(words)
    lines = process.communicate()[1].strip().splitlines()
    if process.returncode:
        raise RuntimeError(lines[-1] if lines else f"{words[0]} ended with code {process.returncode}")


def _started(words):
    """A process that can be interrupted, without Blender's Python, which may be another than Lambent's."""
    group = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP} if os.name == "nt" else {}
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    try:
        return subprocess.Popen(
            words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True,
            errors="replace", env=environment, **group,
        )  # fmt: skip
    except OSError as error:
        advice = "set the command in the preferences"
        raise RuntimeError(f"{words[0]} cannot be started ({error.strerror}): {advice}") from error
