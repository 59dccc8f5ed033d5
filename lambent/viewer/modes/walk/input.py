"""Mouse and keys of the walk mode."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lambent.core.camera import rays_through
from lambent.viewer import cameras
from lambent.viewer.input import CLICK_PX, Input
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.modes.walk.walls import Walls
from lambent.viewer.picking import Geometry

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
    ("Ctrl+S", "save the selected material"),
    ("Ctrl+Q", "close the window"),
    ("P", "save the picture (PNG and EXR)"),
    ("H", "hide or show the panels"),
)
TAP_S = 0.05  # that a key counts for at least


class WalkInput(Input):
    """Looks around and walks; selects objects; moves the divider of a comparison."""

    def __init__(self, state: WalkState, geometry: Geometry) -> None:
        super().__init__(state.screen, state.navigation, state.materials.edits)
        self._state, self._geometry, self._walls = state, geometry, Walls(geometry.triangles)
        self.held: set[str] = set()
        self._tapped: set[str] = set()  # pressed since the last step: a key may be released before a slow frame ends
        self._fast = self._on_divider = self._flew = False

    @property
    def walking(self) -> bool:
        return any(key in cameras.KEYS for key in self.held | self._tapped)

    def walk(self, dt_s: float) -> None:
        """Let the held keys carry the eye for `dt_s` seconds; whoever has just stopped flying comes down."""
        navigation, keys, held = self.navigation, self.held | self._tapped, bool(self.held)
        if not held:
            dt_s = TAP_S
        if dt_s > 0:
            self._tapped.clear()
        camera, bounds, flying = navigation.camera, navigation.bounds, navigation.flying
        height_m, walks = navigation.walker.eye_height_m, navigation.movement == "walk"
        flew, self._flew = self._flew, flying and walks
        if flew and walks and not flying and not navigation.playing:
            floor_y = self._walls.floor_below(camera.position, height_m)
            navigation.move(camera := cameras.standing(camera, bounds, floor_y, height_m))
        if not keys or not walks:
            return
        floor_y = None if flying else self._walls.floor_below(camera.position, height_m)
        moved = cameras.walk(
            camera, navigation.walker, keys, dt_s, bounds=bounds, floor_y=floor_y, flying=flying,
            fast=self._fast, allowed=lambda eye, step: self._walls.allowed(eye, step, height_m),
        )  # fmt: skip
        navigation.move(moved)

    def pointed(self, at: tuple[float, float] | None) -> None:
        self._state.meter.cursor = at

    def pressed(self, x: float) -> None:
        """Take the divider: Dear ImGui would only after a frame with the mouse over it, and frames can be slow."""
        place, divider = self.screen.picture, self._state.comparison.divider
        beside = self._state.comparison.mode == "side by side"
        self._on_divider = beside and abs(x - place.x - divider.share * place.width) <= CLICK_PX

    def dragged(self, dx: float, dy: float) -> None:
        if self._on_divider:
            place = self.screen.picture
            self._state.comparison.divider.move((self._at[0] - place.x) / place.width)
        elif self.navigation.movement == "walk":
            self.navigation.move(cameras.look(self.navigation.camera, dx, dy))
        else:
            super().dragged(dx, dy)

    def clicked(self, x: float, y: float) -> None:
        if self._on_divider:
            return
        camera, place = self.navigation.camera, self.screen.picture
        towards = rays_through(camera, x, y, place.width, place.height)
        found = self._geometry.pick(camera.position, towards)
        self._state.selection.choose(found.name if found else None)

    def keys(self, key: str, event: Mapping[str, Any], ui_has_keys: bool) -> None:
        self._fast = "Shift" in event["modifiers"]
        if event["event_type"] == "key_up":
            self.held.discard(key)
        elif ui_has_keys:
            self.held.clear()
            self._tapped.clear()
        super().keys(key, event, ui_has_keys)

    def pressed_key(self, key: str) -> None:
        state, navigation = self._state, self.navigation
        if key in cameras.KEYS:
            self.held.add(key)
            self._tapped.add(key)
        elif key == "f":
            navigation.flying = not navigation.flying
        elif key == "o":
            navigation.movement = "walk" if navigation.movement == "orbit" else "orbit"
        elif key == "Escape":
            state.selection.choose(None)
        elif key == "v":
            state.recordings.save_view()
        elif key == "r":
            state.recordings.record()
        elif key in "123456789" and int(key) <= len(state.recordings.cameras):
            navigation.jump(state.recordings.cameras[int(key) - 1])

    def saved(self) -> None:
        materials, name = self._state.materials, self._state.selection.material
        if materials.editor is not None:
            materials.editor.save()
        elif name is not None:
            materials.save(name)
