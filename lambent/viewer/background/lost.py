"""Save unsaved work when the window is lost: by an error, a signal, a lost display, or a driver that aborts.

If the X server dies, either Xlib notices first, which calls a handler and then ends the process, or WebGPU does, which
calls `abort`. Neither runs Python's `finally` and `atexit`. Nothing can be saved if the process is killed by SIGKILL or
reads a bad address in the graphics driver.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

from lambent.core.errors import UserError

SIGNALS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))
LIBX11 = "libX11.so.6"
RESCUE_LIMIT_S = 10  # after an abort, for a rescue that waits for a lock which the aborting code holds
_IoErrorHandler = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)
_SignalHandler = ctypes.CFUNCTYPE(None, ctypes.c_int)


def rescued(what: str, write: Callable[[], Iterable[object]]) -> None:
    """Say on stderr where `write` saved unsaved work, or why it could not."""
    try:
        for place in write():
            sys.stderr.write(f"lambent: note: {what} was saved in {place}\n")
    except (UserError, OSError) as error:
        sys.stderr.write(f"lambent: note: {what} could not be saved: {error}\n")


@contextmanager
def kept(rescue: Callable[[], None]) -> Iterator[None]:
    """Context that calls `rescue` once if the window is lost.

    Within it, handlers of terminating signals, of `abort`, and of Xlib's connection error are replaced; they are
    restored after.
    """
    over = False

    def lost() -> None:
        nonlocal over
        if not over:
            over = True  # the rescue itself may fail
            rescue()

    def on_signal(number: int, _: FrameType | None) -> None:
        lost()
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)

    def on_io_error(_: Any) -> int:
        try:
            lost()
        finally:
            sys.stderr.write("lambent: error: the connection to the display was lost\n")
            sys.stderr.flush()
            os._exit(1)  # Xlib would exit, too, but run the graphics driver's exit handlers first
        return 0

    def on_abort(_: int) -> None:
        signal.alarm(RESCUE_LIMIT_S)
        try:
            lost()
        finally:
            sys.stderr.write("lambent: error: the display was lost, or its graphics driver gave up\n")
            sys.stderr.flush()
            os._exit(1)

    main = threading.current_thread() is threading.main_thread()
    mine = [number for number in SIGNALS if main and signal.getsignal(number) == signal.SIG_DFL]
    for number in mine:
        signal.signal(number, on_signal)
    handler = _IoErrorHandler(on_io_error)  # kept alive until Xlib's handler is restored
    xlib = _xlib()
    before = xlib.XSetIOErrorHandler(ctypes.cast(handler, ctypes.c_void_p)) if xlib is not None else None
    try:
        with _aborting_to(on_abort):
            yield
    except Exception:
        lost()
        raise
    finally:
        if xlib is not None:
            xlib.XSetIOErrorHandler(before)
        for number in mine:
            signal.signal(number, signal.SIG_DFL)


@contextmanager
def _aborting_to(handler: Callable[[int], None]) -> Iterator[None]:
    """Context in which `abort` calls `handler`.

    The handler of C is set, not Python's `signal.signal`, whose handlers run after the present call: `abort` has none.
    """
    if os.name != "posix":
        yield
        return
    libc = ctypes.CDLL(None)
    libc.signal.argtypes, libc.signal.restype = (ctypes.c_int, ctypes.c_void_p), ctypes.c_void_p
    called = _SignalHandler(handler)  # kept alive until the handler before is restored
    before = libc.signal(signal.SIGABRT, ctypes.cast(called, ctypes.c_void_p))
    try:
        yield
    finally:
        libc.signal(signal.SIGABRT, before)


def _xlib() -> Any:
    """The Xlib that the window uses, if any."""
    if not sys.platform.startswith("linux") or not os.environ.get("DISPLAY"):
        return None
    try:
        xlib = ctypes.CDLL(LIBX11)
    except OSError:
        return None
    xlib.XSetIOErrorHandler.argtypes, xlib.XSetIOErrorHandler.restype = (ctypes.c_void_p,), ctypes.c_void_p
    return xlib
