"""Frames of the walk's pictures without a window."""

from lambent.viewer.screen import Rect


def drawn(pictures, state, size, steps=1, dt_s=1.0):
    """Draw frames of `size`, and blend as the window does; the state's clock goes on by `dt_s` seconds after each."""
    for _ in range(steps):
        pictures.update(Rect(0, 0, *size), 1.0)
        _ = pictures.images
        state.screen.clock.now_s += dt_s
