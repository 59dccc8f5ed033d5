"""FLIP in a process of its own: the library holds the interpreter while it computes, and the window would stand still.

python -m lambent.viewer.flip_worker < pair.npy > error.npy: a pair (2, H, W, 3) of encoded pictures, its error (H, W).
"""

from __future__ import annotations

import io
import subprocess
import sys
import tempfile
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.errors import UserError
from lambent.core.progress import Progress

Floats = NDArray[np.floating[Any]]
POLL_S = 0.1


def flip_beside(reference: Floats, test: Floats, progress: Progress) -> Floats:
    """FLIP error (H, W) of two encoded pictures; stops the process where `progress` says so."""
    command = [sys.executable, "-m", "lambent.viewer.flip_worker"]
    # Files, not pipes: `communicate` with a timeout writes its input only as far as the first timeout (Python 3.11).
    with tempfile.TemporaryFile() as pair, tempfile.TemporaryFile() as error, tempfile.TemporaryFile() as words:
        np.save(pair, np.stack([reference, test]).astype(np.float32))
        pair.seek(0)
        with subprocess.Popen(command, stdin=pair, stdout=error, stderr=words) as worker:
            try:
                while worker.poll() is None:
                    progress(0, 1, "FLIP")
                    time.sleep(POLL_S)
            except BaseException:
                worker.kill()
                raise
        error.seek(0)
        words.seek(0)
        out, err = error.read(), words.read()
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
