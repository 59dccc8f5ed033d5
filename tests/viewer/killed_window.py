"""A window that edits by itself until it is killed, and what is lost then.

python -m tests.viewer.killed_window TRIES      prints the loss of each try, in seconds, and the largest
python -m tests.viewer.killed_window --edits STORE      the window; prints the number and the time of each edit
"""

import os
import random
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from lambent.store.kept.session import FILE, read_session
from lambent.viewer import app
from lambent.viewer.modes.walk.mode import WalkMode
from tests.viewer.small_store import write_small_store
from tests.viewer.window_session import ROOT, VirtualScreen

STEP = 1e-5  # of kd from one edit to the next
DRAG, SIZE = (1, 400), (320, 240)  # edits of a drag, at least and at most
EARLIEST_S, LATEST_S = 1.0, 9.0  # after the first edit


def said(text):
    """Write a line to stdout."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def edit_in_every_frame():
    """Drag a colour in every frame, in drags of any length."""
    advance, left, number = WalkMode.advance, [0], [0]

    def edits(mode, dt_s):
        advance(mode, dt_s)
        made, kd = mode.state.materials.edits, mode.state.scene.materials["plaster"]
        number[0] += 1
        said(f"{number[0]} {time.monotonic()}")  # before it is made: no edit counts as kept that was not made
        made.change("plaster", kd.model_copy(update={"kd": (number[0] * STEP,) * 3}))
        left[0] -= 1
        if left[0] <= 0:
            made.end_stroke()
            left[0] = random.randint(*DRAG)

    WalkMode.advance, WalkMode.moving = edits, property(lambda mode: True)


def loss_s(store, screen, after_s):
    """Seconds of edits that are lost when the window is killed some seconds after its first edit."""
    command = [sys.executable, "-m", "tests.viewer.killed_window", "--edits", str(store)]
    environment = {**os.environ, "DISPLAY": screen.name}
    window = subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True)
    first = window.stdout.readline()
    assert first, "the window ended"
    time.sleep(after_s)
    window.kill()
    killed_s = time.monotonic()
    lines = [first, *window.stdout.read().splitlines()]
    window.wait()
    made = {int(line.split()[0]): float(line.split()[1]) for line in lines if len(line.split()) == 2}
    session = read_session(store / FILE)  # raises if it cannot be read
    kept = 0 if session is None else round(session.now.materials["plaster"].kd[0] / STEP)
    assert kept <= max(made)
    return max(0.0, killed_s - made[kept + 1]) if kept + 1 in made else 0.0


def losses(tries, folder):
    """The loss of each of some windows, one after the other on one store, killed at random moments."""
    store, screen = write_small_store(folder / "small"), VirtualScreen()
    try:
        for _ in range(tries):
            (store / FILE).unlink(missing_ok=True)
            yield loss_s(store, screen, random.uniform(EARLIEST_S, LATEST_S))
    finally:
        screen.close()


if __name__ == "__main__":
    if sys.argv[1] == "--edits":
        edit_in_every_frame()
        app.run(Path(sys.argv[2]), size=SIZE, folder=Path(sys.argv[2]).parent)
    else:
        with TemporaryDirectory() as made:
            found = []
            for lost_s in losses(int(sys.argv[1]), Path(made)):
                found.append(lost_s)
                said(f"{lost_s:.2f} s")
        said(f"largest of {len(found)}: {max(found):.2f} s")
