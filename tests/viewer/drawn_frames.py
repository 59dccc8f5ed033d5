"""Frames of the walk's pictures without a window."""

import threading

from lambent.viewer.screen import Rect

LONGEST_S = 180.0  # until the tracing process reports: libraries are loaded and kernels compiled first
SHORT_S = 0.1  # the clock of a test does not wait


def drawn(pictures, state, size, steps=1, dt_s=1.0):
    """Draw frames of `size`, and blend as the window does; the state's clock goes on by `dt_s` seconds after each."""
    for _ in range(steps):
        pictures.update(Rect(0, 0, *size), 1.0)
        _ = pictures.images
        state.screen.clock.now_s += dt_s


def until(pictures, state, size, condition):
    """Draw frames when the window would, until a condition is met: fails if nothing wakes it."""
    woken = threading.Event()
    state.screen.wake = woken.set
    while True:
        woken.clear()
        drawn(pictures, state, size)
        if condition():
            return
        assert not pictures._at_rest.fault
        wait_s = pictures.wait_s()
        assert woken.wait(LONGEST_S if wait_s is None else min(wait_s, SHORT_S)) or wait_s is not None, "asleep"
