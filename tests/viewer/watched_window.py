"""Opens the window and writes its state after every frame, for a test that looks on from another process.

python -m tests.viewer.watched_window STORE OUT WIDTHxHEIGHT [walk | view]
python -m tests.viewer.watched_window MEASUREMENT OUT WIDTHxHEIGHT edit:MATERIAL
python -m tests.viewer.watched_window SCENE OUT WIDTHxHEIGHT place:SIZE, the materials of a small view of a scene
python -m tests.viewer.watched_window FILE OUT WIDTHxHEIGHT found:FOLDER, with the modes of a further folder
"""

import faulthandler
import json
import signal
import sys
from dataclasses import asdict
from functools import partial
from pathlib import Path

import wgpu

from lambent.core.errors import UserError
from lambent.core.files import write_text
from lambent.viewer import app, edit, modes, window
from lambent.viewer.modes.edit import state as edit_state
from lambent.viewer.modes.edit.state import EditState
from lambent.viewer.modes.relight.state import RelightState
from lambent.viewer.modes.walk.pictures import Pictures
from tests.viewer.panel_driver import recording

FEW_LIGHTS = (100, 400)  # of a small view
MARK = "F12"  # a key that means nothing: what was sent before it has arrived when it does
INTERRUPT = "F11"  # another: Ctrl-C, while the next frame is drawn to the window
SKIP = "F10"  # another: the display has no image for the next frame
DROP = "F9"  # another: the file named in OUT/dropped.txt is dropped where the mouse is


class WatchedWindow(window.Window):
    frames_drawn = marks_seen = skipped = 0
    interrupt = skip = False

    def __init__(self, *args, **kwargs):
        self.rects = {}
        recording(setattr, self.rects)
        super().__init__(*args, **kwargs)

    def _on_event(self, event):
        super()._on_event(event)
        self.marks_seen += event["event_type"] == "key_down" and event["key"] == MARK
        self.interrupt |= event["event_type"] == "key_down" and event["key"] == INTERRUPT
        if event["event_type"] == "key_down" and event["key"] == DROP:
            self._dropped(self.canvas._window, [(out / "dropped.txt").read_text()])
        self.skip |= event["event_type"] == "key_down" and event["key"] == SKIP

    def _clear(self):
        if self.skip:
            self.skip = False
            self.skipped += 1
            raise wgpu.DrawCancelled("Timeout")
        super()._clear()
        if self.interrupt:
            self.interrupt = False
            signal.raise_signal(signal.SIGINT)

    def _schedule(self):
        super()._schedule()
        self.frames_drawn += 1
        screen, state = self.screen, getattr(self.mode, "state", None)
        seen = {
            "frames": self.frames_drawn,
            "marks": self.marks_seen,
            "settled": self._extra_frames == 0,
            "messages": [m.text for m in screen.messages],
            "resolution": screen.statistics.resolution,
            "integrator": screen.statistics.integrator,
            "at_rest": screen.at_rest,
            "skipped": self.skipped,
            "tracing": tracing_of(self.mode.drawing),
            "drawn": sum(getattr(one, "version", 0) for one in getattr(self.mode.drawing, "shown", ())),
            "moving": self._moving,
            "picture": [screen.picture.width, screen.picture.height],
            "rects": self.rects,
            **(seen_of(state) if state is not None else {}),
        }
        write_text(out / "state.json", json.dumps(seen))


def tracing_of(drawing):
    """Number of the tracing process."""
    tracing = drawing._at_rest._tracing if isinstance(drawing, Pictures) else None
    return None if tracing is None or tracing._process is None else tracing._process._process.pid


def seen_of(state):
    """Of a mode that has a camera and materials."""
    if isinstance(state, EditState):
        return seen_in_place(state)
    if isinstance(state, RelightState):
        return seen_relit(state)
    materials = getattr(state, "materials", None)
    editor = materials.editor if materials else state.editor
    edits = materials.edits if materials else editor.subject.edits
    return {
        "camera": asdict(state.navigation.camera),
        "mode": state.navigation.movement,
        "selected": state.selection.name if materials else None,
        "edited": {name: material.model_dump(mode="json") for name, material in edits.edited.items()},
        "file_names": materials.file_names if materials else {},
        "editor": editor_seen(editor),
    }


def seen_in_place(state):
    frame = state.painter.frame
    return {
        "lights": state.loading.lights,
        "baking": state.baking.line if state.baking is not None else None,
        "trouble": state.trouble,
        "selected": state.material,
        "pointed": state.pointed,
        "edited": {n: one.now != one.start for n, one in state.session.document.materials.items()},
        "merged": state.session.document.merged,
        "noise": state.bounced.noise,
        "samples": state.bounced.samples,
        "busy": state.painter.busy,
        "number": frame.number if frame is not None else 0,
        "brightness": float(frame.radiance.mean()) if frame is not None else 0.0,
        "compared": frame is not None and frame.compared is not None,
    }


def seen_relit(state):
    frame, sky = state.frame, state.edits.sky
    return {
        "relit": state.is_current and not state.busy,
        "said": state.said,
        "turn_deg": sky.turn_deg,
        "sky": sky.environment.file if sky.environment is not None else None,
        "camera": asdict(state.view.camera),
        "brightness": float(frame.shown.radiance.mean()) if frame is not None else 0.0,
        "frame_s": frame.seconds if frame is not None else 0.0,
    }


def editor_seen(editor):
    if editor is None:
        return None
    return {
        "error": editor.shown.error,
        "exact": editor.shown.exact,
        "typed": editor.files.typed,
        "measured": editor.measurement is not None,
        "fitting": editor.fit.work is not None,
    }


if __name__ == "__main__":
    faulthandler.register(signal.SIGUSR1)  # stacks of all threads, see WindowSession.close
    file, out, size = Path(sys.argv[1]), Path(sys.argv[2]), tuple(map(int, sys.argv[3].split("x")))
    window.Window = WatchedWindow
    how, _, path = (sys.argv[4] if len(sys.argv) > 4 else "walk").partition(":")
    try:
        if how == "found":
            modes.__path__.append(path)
            edit.run(file, size=size, folder=out)
        elif how == "place":
            edit_state.EditState = partial(EditState, lights=FEW_LIGHTS)
            edit.run(file, picture=(int(path), int(path)), size=size, folder=out)
        elif how == "edit":
            edit.run(file, Path(path), size=size, folder=out)
        else:
            app.run(file, how, size=size, folder=out)
    except UserError as error:
        sys.exit(f"error: {error}")
