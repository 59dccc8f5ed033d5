"""The edit mode: materials of one view of a scene, edited in place; see `lambent edit`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lambent.viewer.mode import Mode, check_there
from lambent.viewer.screen import Screen

check = check_there  # before a window is opened
STARTS = ("edit",)
NO_DISPLAY = "editing in place needs a display; without one, use `lambent.editing` from Python (docs/editing.md)"


def edits(path: Path) -> bool:
    """Whether the path is a scene, a store or a session."""
    from lambent.viewer.modes.edit.subject import kind_of

    return kind_of(path) is not None


def start(path: Path, name: str, screen: Screen, *, device: Any = None, **options: Any) -> Mode:
    """Start the mode on a scene, a store or a session; options as in `subject.opened`."""
    from lambent.realtime.gpu.device import open_room_device
    from lambent.viewer.edits.shown import backend_of
    from lambent.viewer.modes.edit.drawing import EditDrawing
    from lambent.viewer.modes.edit.mode import EditMode
    from lambent.viewer.modes.edit.state import EditState
    from lambent.viewer.modes.edit.subject import opened

    subject = opened(path, screen, **options)
    device = device or open_room_device()
    state = EditState(subject, screen, backend=backend_of(device))
    return EditMode(state, EditDrawing(device, state))
