"""Parallel loops: called from several threads, after a fork, and beside frames that the processor draws."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

import numba
import pytest

from lambent.core.kernels import yielding_to_frames

PACKAGE = Path(__file__).parents[2] / "lambent"
FOUR_THREADS = """
import threading
import numba, numpy as np
from lambent.baking.light.noise import chart_means
from lambent.core.pictures.half import put_sums
from lambent.editing.products import add_rows

rng = np.random.default_rng(1)
transport = rng.random((16, 3, 100_000)).astype(np.float16)
weights = rng.random((16, 3))
values, known, labels = rng.random((200, 200, 3)), rng.random((200, 200)) < 0.5, rng.integers(0, 3, (200, 200))
lit, rows = rng.random((2, 50_000, 3), np.float32), np.arange(50_000)

def work():
    picture, bits = np.zeros((3, 100_000), np.float32), np.zeros((50_000, 4), np.uint16)
    for _ in range(20):
        add_rows(picture, transport, np.arange(16), weights)
        put_sums(bits, lit, rows, rows, np.ones((2, 3), np.float32))
    means, _ = chart_means(values, known, labels)
    return picture.tobytes() + bits.tobytes() + means.tobytes()

found = []
threads = [threading.Thread(target=lambda: found.append(work())) for _ in range(4)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
alone = work()
assert [one == alone for one in found] == [True] * 4
print(numba.threading_layer())
"""
FORK = """
import os, signal, sys
import numpy as np
from lambent.core import kernels
from lambent.editing.products import add_rows

with kernels._turn:
    child = os.fork()
    if child == 0:
        signal.alarm(120)  # ends a child that waits for ever
        picture = np.zeros((3, 8), np.float32)
        add_rows(picture, np.ones((4, 3, 8), np.float16), np.arange(4), np.ones((4, 3)))
        os._exit(int(picture[0, 0] != 4))
    sys.exit(os.waitpid(child, 0)[1] != 0)
"""


def run(program: str, layer: str) -> subprocess.CompletedProcess[str]:
    settings = os.environ | {"NUMBA_THREADING_LAYER": layer, "NUMBA_BOUNDSCHECK": "0"}
    settings.pop("NUMBA_CACHE_DIR", None)  # of loops with checks, if these tests run with them
    return subprocess.run([sys.executable, "-c", program], env=settings, capture_output=True, text=True)


@pytest.mark.long
@pytest.mark.parametrize("layer", ["workqueue", "default"])
def test_four_threads_at_once_compute_the_bits_of_one_after_the_other(layer: str) -> None:
    ended = run(FOUR_THREADS, layer)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.strip() == layer or layer == "default"


@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system does not fork")
def test_a_forked_process_does_not_wait_for_a_thread_that_it_lacks() -> None:
    assert run(FORK, "workqueue").returncode == 0


@pytest.mark.long
def test_checked_bounds_stop_parallel_loops(tmp_path: Path) -> None:
    settings = os.environ | {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    program = "import numpy as np\nfrom lambent.core.pictures.half import put_sums\n" + (
        "put_sums(np.zeros((2, 4), np.uint16), np.ones((1, 2, 3), np.float32), *np.full((2, 1), 2), "
        "np.ones((1, 3), np.float32))"
    )
    ended = subprocess.run([sys.executable, "-c", program], env=settings, capture_output=True, text=True)
    assert "IndexError: index is out of bounds" in ended.stderr


def test_every_parallel_loop_takes_turns() -> None:
    texts = {path.relative_to(PACKAGE).as_posix(): path.read_text() for path in PACKAGE.rglob("*.py")}
    assert [name for name, text in texts.items() if "parallel=" in text and "njit" in text] == ["core/kernels.py"]
    assert sum(text.count("@parallel(") + text.count("@by_lanes\n") for text in texts.values()) > 20


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
