"""Opens the window and writes its state after every frame, for a test that looks on from another process.

python -m tests.viewer.watched_window STORE OUT WIDTHxHEIGHT [walk | view]
python -m tests.viewer.watched_window MEASUREMENT OUT WIDTHxHEIGHT edit:MATERIAL
"""

import json
import sys
from dataclasses import asdict
from pathlib import Path

from lambent.core.errors import UserError
from lambent.core.files import write_text
from lambent.viewer import app, edit
from tests.viewer.panel_driver import recording

store, out, size = Path(sys.argv[1]), Path(sys.argv[2]), tuple(map(int, sys.argv[3].split("x")))


MARK = "F12"  # a key that means nothing: what was sent before it has arrived when it does


class WatchedWindow(app.Window):
    frames_drawn = marks_seen = 0

    def __init__(self, *args, **kwargs):
        self.rects = {}
        recording(setattr, self.rects)
        super().__init__(*args, **kwargs)

    def _on_event(self, event):
        super()._on_event(event)
        self.marks_seen += event["event_type"] == "key_down" and event["key"] == MARK

    def _schedule(self):
        super()._schedule()
        self.frames_drawn += 1
        state = self.state
        seen = {
            "frames": self.frames_drawn,
            "marks": self.marks_seen,
            "settled": self._extra_frames == 0,
            "camera": asdict(state.camera),
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
            "editor": editor_seen(state.editor),
        }
        write_text(out / "state.json", json.dumps(seen))


def editor_seen(editor):
    if editor is None:
        return None
    shown = editor.shown
    return {
        "error": shown.error,
        "exact": shown.exact,
        "typed": editor.typed,
        "measured": editor.measurement is not None,
        "fitting": editor.fitting is not None,
    }


app.Window = edit.Window = WatchedWindow
mode = sys.argv[4] if len(sys.argv) > 4 else "walk"
try:
    if mode.startswith("edit:"):
        edit.run(store, Path(mode.removeprefix("edit:")), size=size, folder=out)
    else:
        app.run(store, mode, size=size, folder=out)
except UserError as error:
    sys.exit(f"error: {error}")
