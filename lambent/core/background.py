"""Compiled loops of background work beside frames that the processor draws."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def yielding_to_frames(is_software: bool) -> Iterator[None]:
    """Run numba's loops that this thread calls in one thread, if an adapter in software (`is_software`) draws frames.

    Between loops, numba's other threads spin on cores that the frames need.
    """
    if not is_software:
        yield
        return
    import numba  # takes half a second, and most work has imported it

    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        yield
    finally:
        numba.set_num_threads(before)
