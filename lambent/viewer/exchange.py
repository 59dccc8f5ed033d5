"""Exchanges the mode of a window: the room on foot for one of its views, edited in place or relit, and back.

Everything goes by the store's session, which the mode before has written when the next one opens it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lambent.core.errors import UserError
from lambent.viewer import app
from lambent.viewer.mode import Mode

WALK, EDIT, RELIGHT = "walk", "edit", "relight"


def exchanged(mode: Mode, store: Path, before: str, name: str, **options: Any) -> Mode:
    """The mode `name` of a store, by `options`, in place of a mode that was opened by `before`, on its device.

    If it cannot be opened, that is said, and the mode before is opened again.
    """
    screen, device = mode.screen, mode.drawing.device
    screen.exchanging = True
    mode.drawing.close()
    mode.close()
    screen.exchanging, screen.at_rest = False, ""
    try:
        return _started(name, store, mode, device, **options)
    except UserError as error:
        screen.say(f"{name}: {error}")
        return _started(before, store, mode, device)


def _started(name: str, store: Path, mode: Mode, device: Any, **options: Any) -> Mode:
    found: Mode = app.starts()[name].start(store, name, mode.screen, device=device, **options)
    return found
