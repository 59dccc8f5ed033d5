"""Worker process that rebakes a store's light for edited materials, into a copy beside the store.

python -m lambent.viewer.modes.walk.rebake.rebaking_worker STORE COPY

The first line of stdin is a `RoomState` as a JSON object, in light as baked. The end of
stdin ends the process at any moment; the next bake continues the copy. Every line of stdout is a JSON object: "what",
"done" and "total" of a step; "error", a line for the user; "kind" and "there", names of arrays that are now in the
copy; "region", the shape (n, H, W) of light that is finished before its light map (`baking.running.watch`), followed by
its bytes, n H W 3 half floats and H W flags; or "baked", when everything is complete.
"""

from __future__ import annotations

import json
import os
import sys
import threading
from collections.abc import Collection
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from lambent.baking.running.again import KINDS, bake_again
from lambent.baking.running.watch import Watch
from lambent.core.arrays import Flags
from lambent.core.errors import UserError
from lambent.store.kept.images import with_paths
from lambent.store.kept.session import RoomState

NICENESS = 10  # the window has priority
REGION_PAUSE = 10.0  # pause after sending a region, in multiples of the sending time


class StreamWatch(Watch):
    """Reports finished arrays and regions to a stream, one line each, followed by the light of a region."""

    region_pause: float | None = REGION_PAUSE

    def __init__(self, out: BinaryIO, lamps: bool = False) -> None:
        """`lamps`: the light map counts as finished with what it holds of edited lamps."""
        self._out, self._reported, self._lamps = out, set[str](), lamps

    def say(self, **words: object) -> None:
        self._out.write(json.dumps(words).encode() + b"\n")
        self._out.flush()

    def arrived(self, kind: str, names: Collection[str]) -> None:
        if self._lamps:
            kind = {"light_map": "", "lamps": "light_map"}.get(kind, kind)
        new = sorted(set(names) - self._reported)
        if kind in KINDS and new:
            self._reported.update(new)
            self.say(kind=kind, there=new)

    def region(self, light: NDArray[np.float16], finished: Flags) -> None:
        self.say(region=light.shape[:3])
        self._out.write(np.ascontiguousarray(light, np.float16).tobytes())
        self._out.write(np.ascontiguousarray(finished, bool).tobytes())
        self._out.flush()


def main(store: Path, copy: Path, asked: bytes, out: BinaryIO) -> None:
    """Bake, and report progress."""
    wanted = RoomState.model_validate_json(asked)
    watch = StreamWatch(out, bool(wanted.lamps))

    def progress(done: float, total: float, what: str) -> None:
        watch.say(what=what, done=done, total=total)

    try:
        textures = with_paths(wanted.textures, store)
        bake_again(store, copy, wanted.materials, progress, textures=textures, lamps=wanted.lamps, watch=watch)
    except UserError as error:
        watch.say(error=str(error))
    else:
        watch.say(baked=True)


def _end_with(stream: BinaryIO) -> None:
    """End the process when the window has ended; stopping at any moment leaves the store valid."""
    while stream.read(1):
        pass
    os._exit(0)


if __name__ == "__main__":
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    own = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # libraries' output must not mix with the lines
    words = os.fdopen(os.dup(0), "rb", buffering=0)
    first = words.readline()
    if first:
        threading.Thread(target=_end_with, args=(words,), daemon=True).start()
        main(Path(sys.argv[1]), Path(sys.argv[2]), first, own)
