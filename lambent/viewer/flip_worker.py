"""FLIP in a process of its own: the library holds the interpreter while it computes, and the window would stand still.

python -m lambent.viewer.flip_worker < pair.npy > error.npy: a pair (2, H, W, 3) of encoded pictures, its error (H, W).
"""

from __future__ import annotations

import io
import subprocess
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.errors import UserError
from lambent.core.progress import Progress

Floats = NDArray[np.floating[Any]]
POLL_S = 0.1


def flip_beside(reference: Floats, test: Floats, progress: Progress) -> Floats:
    """FLIP error (H, W) of two encoded pictures; stops the process where `progress` says so."""
    pair = io.BytesIO()
    np.save(pair, np.stack([reference, test]).astype(np.float32))
    command = [sys.executable, "-m", "lambent.viewer.flip_worker"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe) as worker:
        given: bytes | None = pair.getvalue()
        try:
            while True:
                try:
                    out, err = worker.communicate(given, timeout=POLL_S)
                    break
                except subprocess.TimeoutExpired:
                    given = None  # communicate goes on with what it was given first
                    progress(0, 1, "FLIP")
        except BaseException:
            worker.kill()
            raise
    if worker.returncode != 0:
        lines = err.decode(errors="replace").strip().splitlines() or ["no reason given"]
        raise UserError(f"FLIP could not be computed ({lines[-1]})")
    return np.asarray(np.load(io.BytesIO(out)))


def main() -> None:
    from lambent.core.metrics import flip_error

    reference, test = np.load(io.BytesIO(sys.stdin.buffer.read()))
    out = io.BytesIO()
    np.save(out, flip_error(reference, test))
    sys.stdout.buffer.write(out.getvalue())


if __name__ == "__main__":
    main()
