"""Compiled parallel loops: called from any threads at once, and beside frames that the processor draws.

numba's layer `workqueue`, the only one without an OpenMP or TBB library (as on macOS), aborts the process when two
threads are in parallel loops at once. There, loops take turns; each uses all cores anyway.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from threading import Lock
from typing import Any

# OpenMP's threads spin while they wait, unless told otherwise before the first kernel is loaded. On 2 cores shared with
# other work, a frame of 512 x 512 pixels took 48 ms with spinning and 12 ms without.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
_turn = Lock()


def parallel(**options: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Compile a loop over `numba.prange`; the result can be called from any threads at once.

    Every parallel loop of Lambent is made here. `options` go to `numba.njit`; the dispatcher is `.compiled`. With
    NUMBA_BOUNDSCHECK=1, loops are serial: numba loses the errors of its other threads.
    """
    import numba

    together = not numba.config.BOUNDSCHECK  # type: ignore[attr-defined]

    def decorate(loop: Callable[..., Any]) -> Callable[..., Any]:
        compiled = numba.njit(parallel=together, cache=True, nogil=True, **options)(loop)

        @wraps(loop)
        def called(*arguments: Any) -> Any:
            if _takes_threads():
                return compiled(*arguments)
            with _turn:
                return compiled(*arguments)

        called.compiled = compiled  # type: ignore[attr-defined]
        return called

    return decorate


def _takes_threads() -> bool:
    """Whether numba's layer bears several threads; not known before the first loop, which chooses the layer."""
    import numba

    try:
        return bool(numba.threading_layer() != "workqueue")  # type: ignore[attr-defined]
    except ValueError:
        return False


def _renew_turn() -> None:
    """In a forked process: the thread that had the turn does not exist there."""
    global _turn
    _turn = Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_renew_turn)


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
