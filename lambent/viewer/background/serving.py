"""The side of a `WorkerProcess` that bakes: low priority, one request, and an end with the window."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from typing import BinaryIO

NICENESS = 10  # the window has priority


def serve(run: Callable[[bytes, BinaryIO], None]) -> None:
    """Run a task on the first line of stdin, with a stream for its lines; the end of stdin ends the process."""
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    own = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # libraries' output must not mix with the lines
    words = os.fdopen(os.dup(0), "rb", buffering=0)
    if first := words.readline():
        threading.Thread(target=_end_with, args=(words,), daemon=True).start()
        run(first, own)
    sys.stdout.flush()


def _end_with(stream: BinaryIO) -> None:
    """End the process when the window has ended; stopping at any moment leaves the store valid."""
    while stream.read(1):
        pass
    os._exit(0)
