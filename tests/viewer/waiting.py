"""Waiting for what threads and processes bring."""

import time


def until(condition, step=lambda: None):
    """Take steps until a condition is met."""
    end_s = time.monotonic() + 180  # never reached but by a machine at a standstill
    while not condition():
        assert time.monotonic() < end_s, "it never happens"
        step()
        time.sleep(0.002)
