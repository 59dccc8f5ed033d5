"""Long work in a background thread: progress, end, cancelling."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from lambent.core.errors import UserError
from lambent.core.progress import Cancelled, Progress

POLL_S = 0.1  # interval of polling for background work


class Work:
    """One task in a separate thread; `poll` reports its end in the window's thread.

    `run` gets a `Progress`, which raises `Cancelled` after `cancel`; `done` gets the result, `failed` a `UserError` of
    `run`. `poll` raises other errors. `wake` is called in the thread once there is an end to report.
    """

    def __init__(
        self,
        run: Callable[[Progress], Any],
        done: Callable[[Any], None],
        failed: Callable[[UserError], None] | None = None,
        wake: Callable[[], None] = lambda: None,
    ) -> None:
        self._run, self._done, self._failed, self._wake = run, done, failed, wake
        self._result: Any = None
        self._error: Exception | None = None
        self._cancelled, self._ended = threading.Event(), threading.Event()
        self.share, self.what = 0.0, "starting"
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def cancel(self) -> None:
        """Ask the task to stop; `run` decides what remains."""
        self._cancelled.set()

    @property
    def cancelling(self) -> bool:
        return self._cancelled.is_set()

    def poll(self) -> bool:
        """Whether the task has ended. Reports the end once: do not call it again after True."""
        if not self._ended.is_set():
            return False
        if self._error is None:
            self._done(self._result)
        elif isinstance(self._error, UserError) and self._failed is not None:
            self._failed(self._error)
        elif not isinstance(self._error, Cancelled):
            raise self._error
        return True

    def wait(self) -> None:
        """Wait until `run` has ended."""
        self._thread.join()

    def _work(self) -> None:
        try:
            self._result = self._run(self._progress)
        except Exception as error:  # noqa: BLE001 reported by poll, in the thread that can show it
            self._error = error
        self._ended.set()
        self._wake()

    def _progress(self, done: float, total: float, what: str) -> None:
        if self._cancelled.is_set():
            raise Cancelled
        self.share, self.what = (done / total if total else 0.0), what


def pending(work: Work | None) -> Work | None:
    """The running work; None once its end was reported."""
    return None if work is None or work.poll() else work
