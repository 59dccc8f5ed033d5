"""A tracing process that is killed while it writes its second picture. python -m tests.viewer.dying_worker ..."""

import json
import os
import signal
import sys

import numpy as np

WIDTH, HEIGHT = 64, 32


def say(**words):
    sys.stdout.buffer.write(json.dumps(words).encode() + b"\n")


if __name__ == "__main__":
    wish = json.loads(sys.stdin.readline())
    picture = np.ones((HEIGHT, WIDTH, 3), np.float32).tobytes()
    say(what="ready", ready=True)
    for samples, data in ((1, picture), (2, picture[: len(picture) // 2])):
        say(number=wish["number"], kind="traced", samples=samples, noise=None, width=WIDTH, height=HEIGHT)
        sys.stdout.buffer.write(data)
    sys.stdout.buffer.flush()
    os.kill(os.getpid(), signal.SIGKILL)
