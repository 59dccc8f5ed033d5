"""Mouse and keys over the picture: the camera in orbit, and the keys that all modes share.

A mode overrides the methods whose behaviour differs. Dear ImGui handles the panels. Events are rendercanvas
dictionaries, positions in logical pixels of the window.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from lambent.core.plain import Triple
from lambent.core.views.camera import Camera
from lambent.viewer.cameras import cameras
from lambent.viewer.cameras.navigation import Navigation
from lambent.viewer.edits.edits import MaterialEdits
from lambent.viewer.gamepad import PadState
from lambent.viewer.screen import Screen
from lambent.viewer.settings import LEAST_SCALE, MOST_SCALE

CLICK_PX = 4.0  # a press that moves less than this is a click, not a drag
LEFT, RIGHT, MIDDLE = 1, 2, 3
NOTCH = 100.0  # of a wheel, in the canvas' unit
SCROLL_PX = 40.0  # of a drag that turns as a notch sideways does
SCALES = {"+": 1.1, "=": 1.1, "-": 1 / 1.1, "0": None}  # of letters and controls; None: as at first


class Input:
    """Translates events into changes of a mode's state. A drag that begins over the interface belongs to it."""

    def __init__(self, screen: Screen, navigation: Navigation, edits: MaterialEdits) -> None:
        self.screen, self.navigation, self.edits = screen, navigation, edits
        self._button: int | None = None  # of the drag that began over the picture
        self._at = (0.0, 0.0)
        self._moved_px = 0.0

    def handle(self, event: Mapping[str, Any], *, ui_has_mouse: bool, ui_has_keys: bool) -> None:
        """Handle one event."""
        kind = event["event_type"]
        if kind.startswith("key_"):
            self.keys(event["key"].lower() if len(event["key"]) == 1 else event["key"], event, ui_has_keys)
            return
        if kind == "pointer_leave":
            self.pointed(None)
            return
        x, y, place = event["x"], event["y"], self.screen.picture
        over = not ui_has_mouse and place.holds(x, y)
        if kind == "pointer_move":
            self.pointed(((x - place.x + 0.5) / place.width, (y - place.y + 0.5) / place.height) if over else None)
            if self._button is not None:
                self._drag(x, y)
        elif kind == "pointer_down" and over:
            if self._button is None:
                self._button, self._at, self._moved_px = event["button"], (x, y), 0.0
            self.pressed(x)
        elif kind == "pointer_up" and event["button"] == self._button:
            if self._button == LEFT and self._moved_px < CLICK_PX:
                self.clicked(x - place.x, y - place.y)
            self._button = None
        elif kind == "wheel" and over:
            self.scrolled(event["dx"] / NOTCH, -event["dy"] / NOTCH, event["modifiers"])

    def _drag(self, x: float, y: float) -> None:
        dx, dy = x - self._at[0], y - self._at[1]
        if self._moved_px < CLICK_PX and math.hypot(dx, dy) < CLICK_PX:
            return  # not yet a drag
        self._at, self._moved_px = (x, y), self._moved_px + math.hypot(dx, dy)
        self.dragged(dx, dy)

    def scrolled(self, right: float, up: float, modifiers: Sequence[str]) -> None:
        """Scroll by notches of a wheel, or parts of them with two fingers: in orbit nearer or farther, and sideways."""
        if self.navigation.movement != "orbit":
            return
        if right:
            self.navigation.move(self.turned(-SCROLL_PX * right, 0.0))
        self.navigation.move(cameras.zoom(self.navigation.camera, up, self.navigation.bounds, self.pivot))

    def steer(self, pad: PadState, dt_s: float) -> None:
        """Answer a gamepad for `dt_s` seconds."""

    @property
    def dragging(self) -> bool:
        """Whether a drag that began over the picture goes on."""
        return self._button is not None and self._moved_px >= CLICK_PX

    @property
    def pivot(self) -> Triple:
        """Centre of orbit and wheel."""
        return self.navigation.camera.target

    def dragged(self, dx: float, dy: float) -> None:
        """Orbit the pivot with the left button, pan with the others."""
        camera = self.navigation.camera
        if self._button == LEFT:
            self.navigation.move(self.turned(dx, dy))
        else:
            self.navigation.move(cameras.pan(camera, dx, dy, self.screen.picture.height))

    def turned(self, dx: float, dy: float) -> Camera:
        """The camera after a drag in orbit."""
        return cameras.orbit(self.navigation.camera, dx, dy, self.pivot)

    def keys(self, key: str, event: Mapping[str, Any], ui_has_keys: bool) -> None:
        """Handle a pressed or released key; letters are lower case."""
        if event["event_type"] != "key_down" or ui_has_keys:
            return
        if "Control" in event["modifiers"] or "Meta" in event["modifiers"]:
            if key == "y" or (key == "z" and "Shift" in event["modifiers"]):
                self.edits.redo()
            elif key == "z":
                self.edits.undo()
            elif key == "s":
                self.saved()
            elif key == "q":
                self.screen.close_wanted = True
            elif key in SCALES:
                self._scale(SCALES[key])
        elif key == "F6":
            self.screen.by_keys = True
        elif key == "p":
            self.screen.save_wanted = True
        elif key == "h":
            self.screen.panels_shown = not self.screen.panels_shown
        else:
            self.pressed_key(key)

    def _scale(self, factor: float | None) -> None:
        now = self.screen.remembered.now.scale
        wanted = 1.0 if factor is None else round(min(max(now * factor, LEAST_SCALE), MOST_SCALE), 2)
        self.screen.remembered.set(scale=wanted)

    # Further events that a mode may handle.

    def pointed(self, at: tuple[float, float] | None) -> None:
        """The mouse moved to these shares of the picture; None outside of it."""

    def pressed(self, x: float) -> None:
        """A button went down over the picture, at x of the window."""

    def clicked(self, x: float, y: float) -> None:
        """The left button was pressed and released at a point of the picture."""

    def pressed_key(self, key: str) -> None:
        """A key that not all modes share was pressed."""

    def saved(self) -> None:
        """Ctrl+S."""
