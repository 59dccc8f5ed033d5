"""Frames of the walk's pictures without a window."""

from lambent.viewer.screen import Rect


def drawn(pictures, state, size, steps=1, dt_s=1.0):
    """Draw frames of `size`; the clock of the state goes on by `dt_s` seconds after each."""
    for _ in range(steps):
        pictures.update(Rect(0, 0, *size), 1.0)
        state.screen.clock.now_s += dt_s
