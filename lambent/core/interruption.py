"""Ctrl-C, also where a library drops the `KeyboardInterrupt`: in the callbacks of a compiler, in destructors."""

from __future__ import annotations

import signal
from types import FrameType
from typing import NoReturn

_seen: list[int] = []  # signals since the command began


def interrupt(number: int, frame: FrameType | None) -> NoReturn:
    """Record Ctrl-C and raise `KeyboardInterrupt`: the handler of SIGINT while a command runs."""
    _seen.append(number)
    signal.default_int_handler(number, frame)


def was_interrupted() -> bool:
    """Whether Ctrl-C has been pressed since the command began."""
    return bool(_seen)


def is_interruption(error: BaseException | None) -> bool:
    """Whether Ctrl-C caused an error.

    An interrupted import fails in many ways. A compiler whose callback was interrupted fails with an error of its own
    that has no `KeyboardInterrupt` as cause: after Ctrl-C, every error but those of the system counts.
    """
    if error is not None and _seen and not isinstance(error, OSError):
        return True
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None
