"""The relight mode: one view of a store's room under a turned or another sky; see `lambent relight`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lambent.core.discovery import known
from lambent.store.store import Store
from lambent.viewer.mode import Mode
from lambent.viewer.screen import Screen

STARTS = ("relight",)
NO_DISPLAY = "name a picture with -o"


def check(path: Path, camera: str | None = None, environment: dict[str, Any] | None = None, **_: object) -> None:
    """Raise `UserError` if there is no room at `path`, or no such camera or image; called before a window is opened."""
    from lambent.viewer.modes.relight.view import cameras_of, sky_of

    cameras = cameras_of(Store.open(path))
    if camera is not None:
        known("camera", camera, cameras, field="--camera")
    if environment is not None:
        sky_of(**environment, folder=path)


def start(path: Path, name: str, screen: Screen, *, device: Any = None, **options: Any) -> Mode:
    """Start the mode on a store; options as of `state.RelightState`."""
    from lambent.realtime.gpu.device import open_room_device
    from lambent.viewer.edits.fitted import FittedDrawing
    from lambent.viewer.edits.shown import backend_of
    from lambent.viewer.modes.relight.mode import RelightMode
    from lambent.viewer.modes.relight.state import RelightState

    device = device or open_room_device()
    state = RelightState(Store.open(path), screen, backend_of(device), **options)
    return RelightMode(state, FittedDrawing(device, state))
