"""What the mouse and the keys do to the state, over the picture. The panels are Dear ImGui's own business.

Events are rendercanvas dictionaries, positions in logical pixels of the window.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from lambent.viewer import cameras
from lambent.viewer.picking import Geometry, ray_through
from lambent.viewer.state import ViewerState

CLICK_PX = 4.0  # a press that moves less than this is a click, not a drag
LEFT, RIGHT, MIDDLE = 1, 2, 3

SHORTCUTS = (
    ("W A S D, arrows", "walk; with Shift faster"),
    ("E, Space / Q, C", "up / down, while flying"),
    ("F", "fly, or come down onto the floor"),
    ("O", "orbit the target, or walk"),
    ("left drag", "look around; in orbit turn about the target"),
    ("right, middle drag", "shift the view (orbit)"),
    ("wheel", "nearer to the target, or away (orbit)"),
    ("click", "select the object under the mouse"),
    ("Esc", "select nothing"),
    ("1 ... 9", "jump to a camera of the scene, or a saved view"),
    ("V", "save the view"),
    ("R", "record the way, or stop"),
    ("Ctrl+Z, Ctrl+Y", "undo, redo a material edit"),
    ("P", "save the picture (PNG and EXR)"),
    ("H", "hide or show the panels"),
)

PREVIEW_SHORTCUTS = (
    ("left drag", "turn about the shape"),
    ("right, middle drag", "shift the view"),
    ("wheel", "nearer, or away"),
    ("1", "the first view again"),
    ("Ctrl+click on a slider", "type a number"),
    ("Ctrl+Z, Ctrl+Shift+Z", "undo, redo a step"),
    ("Ctrl+S", "save the material"),
    ("P", "save the picture (PNG and EXR)"),
    ("H", "hide or show everything but the picture"),
)


@dataclass(frozen=True)
class Rect:
    """The picture's place in the window."""

    x: int
    y: int
    width: int
    height: int

    def holds(self, x: float, y: float) -> bool:
        return self.x <= x < self.x + self.width and self.y <= y < self.y + self.height


@dataclass
class Input:
    """Carries events into the state."""

    geometry: Geometry
    picture: Rect
    held: set[str] = field(default_factory=set)
    _fast: bool = False
    _button: int | None = None  # of the drag that began over the picture
    _at: tuple[float, float] = (0.0, 0.0)
    _moved_px: float = 0.0
    _on_divider: bool = False
    _flew: bool = False

    @property
    def walking(self) -> bool:
        return any(key in cameras.KEYS for key in self.held)

    def handle(self, state: ViewerState, event: Mapping[str, Any], *, ui_has_mouse: bool, ui_has_keys: bool) -> None:
        """Apply one event. What begins over the interface belongs to it, even where it ends over the picture."""
        kind = event["event_type"]
        if kind == "pointer_move":
            self._point(state, event, ui_has_mouse)
        if kind == "pointer_down" and not ui_has_mouse and self.picture.holds(event["x"], event["y"]):
            self._press(event)
            self._on_divider = self._at_divider(state, event["x"])
        elif kind == "pointer_move" and self._button is not None:
            self._drag(state, event)
        elif kind == "pointer_up" and event["button"] == self._button:
            self._release(state, event)
        elif kind == "wheel" and not ui_has_mouse and self.picture.holds(event["x"], event["y"]):
            if state.mode == "orbit":
                state.move(cameras.zoom(state.camera, -event["dy"] / 100, state.scene.bounds))
        elif kind == "key_up":
            self.held.discard(event["key"].lower() if len(event["key"]) == 1 else event["key"])
            self._fast = "Shift" in event["modifiers"]
        elif kind == "key_down":
            self._fast = "Shift" in event["modifiers"]
            if ui_has_keys:
                self.held.clear()
            else:
                self._key(state, event["key"], event["modifiers"])

    def walk(self, state: ViewerState, dt_s: float) -> None:
        """Let the held keys carry the eye for `dt_s` seconds; who has just stopped flying comes down."""
        flew, self._flew = self._flew, state.flying and state.mode == "walk"
        if flew and not self._flew and state.mode == "walk" and not state.playing:
            position, height_m = state.camera.position, state.walker.eye_height_m
            floor_y = self.geometry.floor_below(position, height_m)
            state.move(cameras.standing(state.camera, state.scene.bounds, floor_y, height_m))
        if not self.walking or state.mode != "walk":
            return
        bounds = state.scene.bounds
        height = state.walker.eye_height_m
        moved = cameras.walk(
            state.camera,
            self.held,
            dt_s,
            bounds=bounds,
            floor_y=None if state.flying else self.geometry.floor_below(state.camera.position, height),
            flying=state.flying,
            fast=self._fast,
            pace_m_s=state.walker.speed_m_s,
            height_m=height,
            allowed=lambda eye, step: self.geometry.allowed(eye, step, height),
        )
        state.move(moved)

    def _point(self, state: ViewerState, event: Mapping[str, Any], ui_has_mouse: bool) -> None:
        over = not ui_has_mouse and self.picture.holds(event["x"], event["y"])
        x, y = event["x"] - self.picture.x + 0.5, event["y"] - self.picture.y + 0.5
        state.meter.cursor = (x / self.picture.width, y / self.picture.height) if over else None

    def _press(self, event: Mapping[str, Any]) -> None:
        if self._button is None:
            self._button, self._at, self._moved_px = event["button"], (event["x"], event["y"]), 0.0

    def _at_divider(self, state: ViewerState, x: float) -> bool:
        """Whether a press is at the line between two pictures. Dear ImGui would see it only once it was drawn hovered,
        and a frame of two pictures can be slow."""
        comparison = state.comparison
        if comparison is None or comparison.mode != "side by side":
            return False
        return abs(x - self.picture.x - comparison.split * self.picture.width) <= CLICK_PX

    def _drag(self, state: ViewerState, event: Mapping[str, Any]) -> None:
        dx, dy = event["x"] - self._at[0], event["y"] - self._at[1]
        if self._moved_px < CLICK_PX and math.hypot(dx, dy) < CLICK_PX:
            return  # not yet a drag
        self._at, self._moved_px = (event["x"], event["y"]), self._moved_px + math.hypot(dx, dy)
        if self._on_divider and state.comparison is not None:
            state.comparison.split = min(max((event["x"] - self.picture.x) / self.picture.width, 0.02), 0.98)
        elif state.mode == "walk":
            state.move(cameras.look(state.camera, dx, dy))
        elif self._button == LEFT:
            state.move(cameras.orbit(state.camera, dx, dy))
        else:
            state.move(cameras.pan(state.camera, dx, dy, self.picture.height))

    def _release(self, state: ViewerState, event: Mapping[str, Any]) -> None:
        was_click = self._button == LEFT and self._moved_px < CLICK_PX and not self._on_divider
        self._button = None
        if was_click:
            if state.preview is not None:
                return  # there is nothing else to select
            x, y = event["x"] - self.picture.x, event["y"] - self.picture.y
            found = self.geometry.pick(*ray_through(state.camera, x, y, self.picture.width, self.picture.height))
            state.select(found.name if found else None)

    def _key(self, state: ViewerState, key: str, modifiers: tuple[str, ...]) -> None:
        letter = key.lower() if len(key) == 1 else key
        if "Control" in modifiers or "Meta" in modifiers:
            if letter == "y" or (letter == "z" and "Shift" in modifiers):
                state.edits.redo()
            elif letter == "z":
                state.edits.undo()
            elif letter == "s" and state.editor is not None:
                state.editor.save()
        elif letter == "p":
            state.screenshot_wanted = True
        elif letter == "h":
            state.panels_shown = not state.panels_shown
        elif state.preview is not None:
            if letter == "1":
                state.jump(state.scene.cameras[0])
        elif letter in cameras.KEYS:
            self.held.add(letter)
        elif letter == "f":
            state.flying = not state.flying
        elif letter == "o":
            state.mode = "walk" if state.mode == "orbit" else "orbit"
        elif letter == "Escape":
            state.select(None)
        elif letter == "v":
            state.save_view()
        elif letter == "r":
            state.record()
        elif letter in "123456789" and int(letter) <= len(state.cameras):
            state.jump(state.cameras[int(letter) - 1])
