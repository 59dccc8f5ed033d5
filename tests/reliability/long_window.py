"""Hours of one window: walking, editing, mixing light, resizing, baking again, on a screen of its own.

    python -m tests.reliability.long_window --minutes 120 --out rows.jsonl
    python -m tests.reliability.long_window --read rows.jsonl      what the rows so far say

Each minute is a row of the file: memory, threads, open files, and what was done. The median memory of the last quarter
of the rows may exceed that of the second by 5 %, and every comparison with the session on disk must find every edit.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

FLAT = 1.05  # of the second quarter's memory, at most
ROW_S = 60.0
IDLE_S = 0.1  # between frames while background work is waited for
SIZE = (640, 480)


def resident_mib(process: str = "self") -> float:
    """Resident memory of a process."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def below(process: int) -> Iterator[int]:
    """Processes that a process has begun, and those that these have."""
    for child in Path(f"/proc/{process}/task").glob("*/children"):
        for number in child.read_text().split():
            yield int(number)
            yield from below(int(number))


def children_mib() -> tuple[int, float]:
    """Number and resident memory of this process's workers."""
    found = []
    for number in below(os.getpid()):
        try:
            found.append(resident_mib(str(number)))
        except FileNotFoundError:  # it has just ended
            continue
    return len(found), sum(found)


def row(hands: Any, begun_s: float, frames: int) -> dict[str, Any]:
    """What is measured now."""
    import wgpu

    counts = wgpu.diagnostics.object_counts.get_dict()
    workers, mib = children_mib()
    return {
        "minute": round((time.monotonic() - begun_s) / 60, 2),
        "resident_mib": round(resident_mib(), 1),
        "workers": workers,
        "workers_mib": round(mib, 1),
        "gpu_objects": {name: counts[name]["count"] for name in ("Buffer", "Texture", "TextureView", "BindGroup")},
        "threads": len(list(Path("/proc/self/task").iterdir())),
        "files": len(list(Path("/proc/self/fd").iterdir())),
        "frames": frames,
        "done": dict(hands.done),
        "lost": list(hands.lost),
    }


def verdict(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Memory of the second and the last quarter of the rows, their ratio, the work, and lost edits."""
    quarter = len(rows) // 4
    if quarter == 0:
        raise SystemExit("four rows at least")
    mib = np.array([one["resident_mib"] for one in rows])
    second, last = float(np.median(mib[quarter : 2 * quarter])), float(np.median(mib[-quarter:]))
    after = rows[-1]
    grown = {name: after[name] - rows[quarter][name] for name in ("threads", "files")}
    return {
        "minutes": after["minute"], "second_mib": second, "last_mib": last, "ratio": round(last / second, 4),
        "grown": grown, "frames": after["frames"], "done": after["done"], "lost": after["lost"],
        "held": last <= FLAT * second and not after["lost"],
    }  # fmt: skip


def show(store: Path, folder: Path, minutes: float, seed: int, out: Path) -> None:
    """Open the window, and act in it; `DISPLAY` is set."""
    from lambent.viewer import app, window
    from lambent.viewer.modes.edit import state as edit_state
    from tests.reliability.scripted_hands import Hands
    from tests.viewer.panel_driver import recording
    from tests.viewer.watched_window import FEW_LIGHTS

    class ScriptedWindow(window.Window):
        def __init__(self, *args: Any, **kwargs: Any) -> None:
            self.rects: dict[str, Any] = {}
            recording(lambda at, name, made: setattr(at, name, made) if "slider" in name else None, self.rects)
            super().__init__(*args, **kwargs)
            self._hands, self._begun_s, self._count = Hands(self, store, seed), time.monotonic(), 0
            self._acts = self._hands.frames(self._begun_s + 60 * minutes)
            self._row_s = self._begun_s + ROW_S

        def _interface(self) -> None:
            self.rects.clear()
            super()._interface()

        def _schedule(self) -> None:
            super()._schedule()
            self._count += 1
            if time.monotonic() >= self._row_s:
                self._row_s += ROW_S
                self._write()
            if next(self._acts, self) is self:
                self._write()
                window.loop.call_soon(self.canvas.close)
            if self._hands.waits:
                window.loop.call_later(IDLE_S, self.canvas.request_draw)
            else:
                self.canvas.request_draw()

        def _write(self) -> None:
            made = row(self._hands, self._begun_s, self._count)
            with out.open("a") as file:
                file.write(json.dumps(made) + "\n")
            sys.stderr.write(
                f"{made['minute']:.1f} min: {made['resident_mib']:.0f} MiB, {self._count} frames, "
                f"{self._hands.done.total()} actions, {len(self._hands.lost)} lost\n"
            )

    window.Window = ScriptedWindow
    edit_state.EditState = partial(edit_state.EditState, lights=FEW_LIGHTS)
    app.run(store, size=SIZE, folder=folder)


def baked(folder: Path) -> Path:
    """The built-in box with its light in groups, small."""
    from lambent.baking.bake import bake
    from lambent.scenes.loaders.load import load_scene
    from tests.baking.small_scenes import TINY

    bake(load_scene("builtin:box"), folder / "box.store", quality=TINY, light_groups="scene").close()
    return folder / "box.store"


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--minutes", type=float, default=120.0)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--out", type=Path, default=Path("rows.jsonl"))
    options.add_argument("--store", type=Path, help="a store to copy, instead of the built-in box")
    options.add_argument("--read", type=Path, help="print what the rows of a file say")
    given = options.parse_args()
    if given.read is None:
        from tests.viewer.window_session import VirtualScreen

        given.out.unlink(missing_ok=True)
        screen = VirtualScreen()
        try:
            with TemporaryDirectory() as made:
                folder = Path(made)
                os.environ |= {"DISPLAY": screen.name, "XDG_CONFIG_HOME": str(folder / "config")}
                os.environ.pop("WAYLAND_DISPLAY", None)
                store = baked(folder) if given.store is None else copied(given.store, folder)
                show(store, folder, given.minutes, given.seed, given.out)
        finally:
            screen.close()
    rows = [json.loads(line) for line in (given.read or given.out).read_text().splitlines()]
    found = verdict(rows)
    print(json.dumps(found, indent=1))  # noqa: T201
    sys.exit(not found["held"])


def copied(store: Path, folder: Path) -> Path:
    return Path(shutil.copytree(store, folder / store.name))


if __name__ == "__main__":
    main()
