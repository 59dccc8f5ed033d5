"""Opens the window and writes its state after every frame, for a test that looks on from another process.

python -m tests.viewer.watched_window STORE OUT WIDTHxHEIGHT [MODE]
"""

import functools
import json
import sys
from pathlib import Path

from lambent.core.errors import UserError
from lambent.core.files import write_text
from lambent.viewer import app
from tests.viewer.panel_driver import recording

store, out, size = Path(sys.argv[1]), Path(sys.argv[2]), tuple(map(int, sys.argv[3].split("x")))


class WatchedWindow(app.Window):
    frames_drawn = 0

    def __init__(self, *args, **kwargs):
        self.rects = {}
        recording(setattr, self.rects)
        super().__init__(*args, **kwargs)

    def _schedule(self):
        super()._schedule()
        self.frames_drawn += 1
        state = self.state
        seen = {
            "frames": self.frames_drawn,
            "camera": state.camera.model_dump(),
            "mode": state.mode,
            "selected": state.selected,
            "edited": {name: material.model_dump(mode="json") for name, material in state.edits.edited.items()},
            "messages": [m.text for m in state.messages],
            "resolution": state.statistics.resolution,
            "integrator": state.statistics.integrator,
            "accumulated": state.statistics.accumulated,
            "moving": self._moving,
            "file_names": state.file_names,
            "picture": [self._input.picture.width, self._input.picture.height],
            "rects": self.rects,
        }
        write_text(out / "state.json", json.dumps(seen))


app.Window = WatchedWindow
try:
    functools.partial(app.run, store, *sys.argv[4:5], size=size, folder=out)()
except UserError as error:
    sys.exit(f"error: {error}")
