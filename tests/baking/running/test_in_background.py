"""Work beside the main thread: in order, all of it, and its errors are raised."""

from __future__ import annotations

import time

import pytest

from lambent.baking.running.in_background import AHEAD, background


def test_work_is_done_in_order() -> None:
    done: list[int] = []

    def work(i: int) -> None:
        time.sleep(0.002 if i % 3 == 0 else 0)
        done.append(i)

    with background() as after:
        for i in range(3 * AHEAD):
            after.do(work, i)
    assert done == list(range(3 * AHEAD))


def test_the_error_of_work_is_raised() -> None:
    def fail() -> None:
        raise ValueError("no space")

    with pytest.raises(ValueError, match="no space"), background() as after:
        after.do(fail)


def test_what_was_given_is_done_though_the_block_fails() -> None:
    done: list[int] = []
    with pytest.raises(KeyError), background() as after:
        after.do(time.sleep, 0.05)
        after.do(done.append, 1)
        raise KeyError
    assert done == [1]
