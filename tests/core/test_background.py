"""Compiled loops of background work leave the cores to frames that the processor draws."""

from __future__ import annotations

import threading

import numba
import pytest

from lambent.core.background import yielding_to_frames


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="one core")
def test_loops_beside_frames_take_one_thread_and_those_of_other_threads_all() -> None:
    before, seen = numba.get_num_threads(), []

    def work() -> None:
        for is_software in (True, False):
            with yielding_to_frames(is_software):
                seen.append(numba.get_num_threads())
        with pytest.raises(ValueError, match="fault"), yielding_to_frames(is_software=True):
            raise ValueError("fault")
        seen.append(numba.get_num_threads())

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [1, before, before]
    assert numba.get_num_threads() == before
