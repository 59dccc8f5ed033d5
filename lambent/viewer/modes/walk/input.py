"""Mouse and keys of the walk mode."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.plain import Triple, triple
from lambent.core.views.camera import Camera, rays_through
from lambent.materials.clear import clear_terms
from lambent.store.contract import ObjectRecord
from lambent.viewer.cameras import cameras
from lambent.viewer.cameras.framing import framed
from lambent.viewer.cameras.picking import Geometry
from lambent.viewer.gamepad import PadState
from lambent.viewer.input import CLICK_PX, LEFT, SCROLL_PX, Input
from lambent.viewer.modes.walk import offers
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.modes.walk.views.walls import Walls

SHORTCUTS = (
    ("W A S D, arrows", "walk; faster with Shift"),
    ("E, Space / Q, C", "up / down, while flying"),
    ("F", "frame the selected object and orbit it"),
    ("O", "orbit, or walk"),
    ("G", "fly, or return to the floor"),
    ("left drag", "look around; in orbit: turn about the selected object or the target"),
    ("right, middle drag", "pan (orbit)"),
    ("wheel, two fingers", "step ahead or back, sideways: turn; in orbit: nearer or farther"),
    ("pinch, Ctrl+wheel", "change the field of view"),
    ("gamepad", "sticks walk and look, triggers slow down and speed up; A next view, B next variant, Start next size"),
    ("click", "select the object under the mouse"),
    ("drag a lamp's mark", "move the lamp in the plane of the view (Lamps panel)"),
    ("Esc", "clear the selection"),
    ("1 ... 9", "jump to a camera of the scene or a saved view"),
    ("V", "save the view"),
    ("R", "record a walk, or stop"),
    ("X", "swap the room with the state beside it, or with the bake"),
    ("Ctrl+Z / Ctrl+Shift+Z, Ctrl+Y", "undo / redo a change of a material or the light"),
    ("Ctrl+S", "write the session now; it is saved by itself"),
    ("Ctrl+Q", "close the window"),
    ("P", "save the picture (PNG and EXR)"),
    ("H", "hide or show the panels"),
    ("M, Shift+M", "the next size of the window: show, design, measure; the one before"),
    ("+, -", "brighter, darker by 1/3 EV"),
    ("Tab, F6 (in every mode)", "the controls by arrows, Space and Enter; Esc returns to the picture"),
    ("Ctrl++, Ctrl+-, Ctrl+0", "larger or smaller letters; as at first"),
    ("F1", "show the first card again"),
)
CARD = (  # of the first start
    "Walk with W A S D or the arrows, look around with the left mouse button.",
    "Click a thing to change its material and to see the light that falls on it.",
    "M changes the window: show for a client, design, measure with all numbers.",
    "Drop files onto things: materials, measurements, images, luminaires. F1 shows this card.",
)
LARGE = 0.5  # radius / distance of objects from which on orbit turns about the clicked point, not the object's middle
PIECE_PX = 12.0  # length of the pieces of a drag in orbit that are checked for walls
STEPS = {"+": 1, "=": 1, "-": -1}  # of the exposure, 1/3 EV
DROP_PX = 60.0  # from a lamp to where a file is dropped onto it
PANES = 20  # of clear glass that the sky is looked for behind
FOV_DEG = (10.0, 120.0)
NOTCH_S = 0.15  # of walking, for a notch of the wheel
PAD_PX_S, PAD_NOTCHES_S = 400.0, 6.0  # of a drag that turns as a whole deflection does; of a wheel
TAP_S = 0.05  # least time that a key press counts


class WalkInput(Input):
    """Looks around and walks; selects objects; moves the divider of a comparison."""

    def __init__(self, state: WalkState, geometry: Geometry) -> None:
        super().__init__(state.screen, state.navigation, state.materials.edits)
        self._state, self._geometry, self._walls = state, geometry, Walls(geometry.triangles)
        self.held: set[str] = set()
        self._tapped: set[str] = set()  # pressed since the last step; may be released before a slow frame ends
        self._fast = self._on_divider = self._flew = False
        self._lamp: int | None = None  # the lamp that the mouse holds
        self._pushed: frozenset[str] = frozenset()  # buttons of a gamepad
        self._steered = False  # whether its sticks move the eye

    @property
    def walking(self) -> bool:
        return self._steered or any(key in cameras.KEYS for key in self.held | self._tapped)

    def walk(self, dt_s: float) -> None:
        """Move the eye by the held keys for `dt_s` seconds; after flying, return to the floor."""
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
        if keys and walks:
            self._step(keys, dt_s, cameras.FAST if self._fast else 1.0)

    def _step(
        self, keys: AbstractSet[str], dt_s: float, fast: float = 1.0, stick: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        navigation, flying = self.navigation, self.navigation.flying
        camera, height_m = navigation.camera, navigation.walker.eye_height_m
        floor_y = None if flying else self._walls.floor_below(camera.position, height_m)
        moved = cameras.walk(
            camera, navigation.walker, keys, dt_s, bounds=navigation.bounds, floor_y=floor_y, flying=flying, fast=fast,
            stick=stick, allowed=lambda eye, step: self._walls.allowed(eye, step, height_m),
        )  # fmt: skip
        navigation.move(moved)

    def scrolled(self, right: float, up: float, modifiers: Sequence[str]) -> None:
        """On foot, step ahead or back, and turn sideways; with Ctrl, as a pinch says it, change the field of view."""
        navigation = self.navigation
        if "Control" in modifiers and up:
            fov_deg = navigation.camera.fov_y_deg * cameras.ZOOM_PER_STEP**up
            navigation.set_fov(min(max(fov_deg, FOV_DEG[0]), FOV_DEG[1]))
        elif navigation.movement == "orbit":
            super().scrolled(right, up, modifiers)
        else:
            if right:
                navigation.move(cameras.look(navigation.camera, SCROLL_PX * right, 0.0))
            if up:
                self._step({"w" if up > 0 else "s"}, NOTCH_S * abs(up))

    def steer(self, pad: PadState, dt_s: float) -> None:
        """Walk by the left stick, look by the right one; a button acts once for each press."""
        self._push(pad.pressed - self._pushed)
        self._pushed, self._steered = pad.pressed, pad.moves
        dt_s = min(dt_s, cameras.LONGEST_STEP_S)
        (across, ahead), (right, up) = pad.left, pad.right
        turn_px = dt_s * PAD_PX_S
        if not pad.moves or not dt_s:
            return
        if self.navigation.movement == "orbit":
            self.navigation.move(self.turned(-turn_px * right, turn_px * up))
            super().scrolled(0.0, PAD_NOTCHES_S * dt_s * ahead, ())
            return
        self.navigation.move(cameras.look(self.navigation.camera, turn_px * right, -turn_px * up))
        fast = cameras.FAST**pad.faster / cameras.FAST**pad.slower
        self._step(set(), dt_s, fast, (across, ahead))

    def _push(self, buttons: AbstractSet[str]) -> None:
        state = self._state
        chosen = offers.views(state).next() if "A" in buttons else None
        chosen = offers.variants(state.states).next() if "B" in buttons else chosen
        if "Start" in buttons:
            self.screen.next_size()
        if chosen is not None:
            self.screen.say(chosen)

    def pointed(self, at: tuple[float, float] | None) -> None:
        self._state.meter.cursor = at

    def pressed(self, x: float) -> None:
        """Grab the divider here, because Dear ImGui reacts only after a frame with the mouse over it."""
        place, divider = self.screen.picture, self._state.divider
        self._on_divider = divider is not None and abs(x - place.x - divider.share * place.width) <= CLICK_PX
        grabs = self._button == LEFT and not self._on_divider and not self._state.lamps.aiming
        self._lamp = self._lamp_at(*self._at) if grabs else None

    @property
    def moves_lamp(self) -> bool:
        """Whether the mouse holds a lamp."""
        return self._button is not None and self._lamp is not None

    def choose_lamp_under_cursor(self) -> None:
        """Choose the nearest lamp around the mouse, also one whose mark is not shown."""
        if (cursor := self._state.meter.cursor) is not None:
            self._lamp_at(*self.screen.picture.point(*cursor), reach_px=DROP_PX)

    def _lamp_at(self, x: float, y: float, reach_px: float | None = None) -> int | None:
        place, state = self.screen.picture, self._state
        at = x - place.x, y - place.y
        return state.lamps.pick(state.navigation.camera, at, (max(1, place.width), max(1, place.height)), reach_px)

    def _under(self, x: float, y: float) -> tuple[ObjectRecord | None, Floats]:
        """The object at a point of the picture, and the place (3,) that was hit there."""
        camera, place = self.navigation.camera, self.screen.picture
        towards = rays_through(camera, x, y, place.width, place.height)
        found, distance_m = self._geometry.hit(camera.position, towards)
        return found, np.array(camera.position) + (distance_m if found is not None else 0.0) * towards

    @property
    def is_over_sky(self) -> bool:
        """Whether the mouse is over the picture, and over nothing but clear glass there."""
        if (cursor := self._state.meter.cursor) is None:
            return False
        camera, place = self.navigation.camera, self.screen.picture
        towards = rays_through(camera, cursor[0] * place.width, cursor[1] * place.height, place.width, place.height)
        found, distance_m, eye = None, 0.0, np.array(camera.position)
        for _ in range(PANES):
            found, distance_m = self._geometry.hit(eye, towards)
            if found is None or clear_terms(self._state.materials.edits.current(found.material)) is None:
                break
            eye = eye + (distance_m + cameras.NEAREST_M / 10) * towards
        return found is None

    def select_under_cursor(self) -> None:
        """Select the object under the mouse; keep the selection where there is none."""
        cursor, place = self._state.meter.cursor, self.screen.picture
        if cursor is not None:
            found, _ = self._under(cursor[0] * place.width, cursor[1] * place.height)
            self._state.selection.choose(found.name if found is not None else self._state.selection.name)

    def dragged(self, dx: float, dy: float) -> None:
        divider = self._state.divider
        if self._lamp is not None:
            place, camera = self.screen.picture, self.navigation.camera
            self._state.lamps.drag(self._lamp, camera, dx, dy, (place.width, place.height))
            return
        if self._on_divider and divider is not None:
            place = self.screen.picture
            divider.move((self._at[0] - place.x) / place.width)
        elif self.navigation.movement == "walk":
            self.navigation.move(cameras.look(self.navigation.camera, dx, dy))
        else:
            super().dragged(dx, dy)

    def clicked(self, x: float, y: float) -> None:
        if self._on_divider or self._lamp is not None:
            return
        camera, place = self.navigation.camera, self.screen.picture
        found, hit = self._under(x, y)
        distance_m = math.inf if found is None else math.dist(hit, camera.position)
        if self._state.lamps.aiming:
            if found is not None:
                self._state.lamps.aim_at(triple(hit))
            return
        at_px = (x - place.x, y - place.y)
        if self._state.fields.pick(camera, at_px, (place.width, place.height), distance_m):
            return
        if found is None:
            self._state.selection.choose(None)
            return
        radius_m = math.dist(*found.bounds) / 2
        self._state.selection.choose(found.name, triple(hit) if radius_m > LARGE * distance_m else None)

    @property
    def pivot(self) -> Triple:
        return self._state.selection.pivot or super().pivot

    def turned(self, dx: float, dy: float) -> Camera:
        """Orbit; a camera within the scene stays inside, and moves towards the pivot if a wall is in the way."""
        navigation, pivot = self.navigation, self.pivot
        camera, bounds = navigation.camera, navigation.bounds
        pieces = math.ceil(math.hypot(dx, dy) / PIECE_PX)
        for _ in range(pieces):
            after = cameras.orbit(camera, dx / pieces, dy / pieces, pivot)
            if cameras.is_within(camera.position, bounds):
                after = cameras.nearer(after, pivot, self._walls.share(pivot, camera.position, after.position, bounds))
            camera = after
        return camera

    def _frame(self) -> None:
        """Frame the selected object, and orbit it."""
        navigation, place, found = self.navigation, self.screen.picture, self._state.selection.record
        if found is None:
            self.screen.say("nothing to frame: select an object first")
            return
        eye, bounds = navigation.camera.position, navigation.bounds
        is_enclosing = cameras.is_within(eye, found.bounds)  # such as walls: seen from within

        def free_m(point: Floats, direction: Floats) -> float:
            out_m = cameras.way_out_m(point, direction, bounds) if cameras.is_within(eye, bounds) else math.inf
            return min(self._geometry.free_m(point, direction, "" if is_enclosing else found.name), out_m)

        navigation.move(framed(navigation.camera, found.bounds, place.width / place.height, free_m))
        navigation.movement, self._state.selection.pointed = "orbit", None

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
            self._frame()
        elif key == "g":
            navigation.flying = not navigation.flying
        elif key == "o":
            navigation.movement = "walk" if navigation.movement == "orbit" else "orbit"
        elif key == "Escape" and self.screen.card_shown:
            self.screen.card_shown = False
        elif key == "Escape":
            state.selection.choose(None)
        elif key == "m":
            self.screen.next_size(-1 if self._fast else 1)
        elif key in STEPS:
            state.look.step(STEPS[key])
        elif key == "Tab":
            self.screen.by_keys = True
        elif key == "F1":
            self.screen.card_shown = not self.screen.card_shown
        elif key == "v":
            state.recordings.save_view()
        elif key == "x":
            state.states.exchange()
        elif key == "r":
            state.recordings.record()
        elif key in "123456789" and int(key) <= len(state.recordings.cameras):
            state.recordings.visit(state.recordings.cameras[int(key) - 1])

    def saved(self) -> None:
        editor = self._state.materials.editor
        if editor is not None:
            editor.save()
        else:
            self._state.session.save()
