"""A process of its own that bakes a store's light anew for edited materials, into a copy beside the store.

python -m lambent.viewer.modes.walk.rebaking_worker STORE COPY

The first line of stdin is a JSON object with "materials", documents by name, and "textures", names by name; the end of
stdin ends the process, at any moment, and the copy goes on from there the next time. Every line of stdout is a JSON
object: "what", "done" and "total" of a step; "error", a line for the user; or "baked", when all of it is there.
"""

from __future__ import annotations

import json
import os
import sys
import threading
from pathlib import Path
from typing import BinaryIO

from lambent.core.errors import UserError
from lambent.materials.document import Material

NICENESS = 10  # the window comes first


def main(store: Path, copy: Path, asked: bytes, out: BinaryIO) -> None:
    """Bake, and say how far it is."""
    from lambent.bake.again import bake_again

    wanted = json.loads(asked)
    materials = {name: Material.model_validate(said) for name, said in wanted["materials"].items()}

    def say(**words: object) -> None:
        out.write(json.dumps(words).encode() + b"\n")
        out.flush()

    def progress(done: float, total: float, what: str) -> None:
        say(what=what, done=done, total=total)

    try:
        bake_again(store, copy, materials, progress, textures=wanted["textures"])
    except UserError as error:
        say(error=str(error))
    else:
        say(baked=True)


def _end_with(stream: BinaryIO) -> None:
    """End the process where the window has ended, however that was: a store may be left at any moment."""
    while stream.read(1):
        pass
    os._exit(0)


if __name__ == "__main__":
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    own = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print is none of the lines
    words = os.fdopen(os.dup(0), "rb", buffering=0)
    first = words.readline()
    if first:
        threading.Thread(target=_end_with, args=(words,), daemon=True).start()
        main(Path(sys.argv[1]), Path(sys.argv[2]), first, own)
