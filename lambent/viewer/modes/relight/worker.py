"""Worker process that bakes a view of a store's room for relighting.

python -m lambent.viewer.modes.relight.worker STORE

The first line of stdin is a JSON object: the "room", a `RoomState`, and the view, a `ViewRecord`. Every line of stdout
is a JSON object: "what", "done" and "total" of a step, or "error", a line for the user.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import BinaryIO

from lambent.bake.running.relit import Relit
from lambent.bake.transport.view import View
from lambent.core.errors import UserError
from lambent.store.contract import ViewRecord
from lambent.store.kept.session import RoomState
from lambent.viewer.background.serving import serve


def main(folder: Path, asked: bytes, out: BinaryIO) -> None:
    """Bake, and report progress."""
    wanted = json.loads(asked)
    view = ViewRecord.model_validate(wanted["view"])

    def say(**words: object) -> None:
        out.write(json.dumps(words).encode() + b"\n")
        out.flush()

    try:
        relit = Relit(folder, RoomState.model_validate(wanted["room"]), View(view.camera, view.width, view.height))
        relit.bake(lambda done, total, what: say(what=what, done=done, total=total))
    except UserError as error:
        say(error=str(error))


if __name__ == "__main__":
    serve(lambda asked, out: main(Path(sys.argv[1]), asked, out))
