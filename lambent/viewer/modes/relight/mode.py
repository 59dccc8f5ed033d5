"""The relight mode: its panels, its input, and its picture."""

from __future__ import annotations

from functools import partial

from imgui_bundle import imgui

from lambent.core.light.photometry import LUMINANCE
from lambent.viewer.background.lost import rescued
from lambent.viewer.cameras.navigation import Navigation
from lambent.viewer.input import Input
from lambent.viewer.mode import Drawing, Mode, Panel, Textures
from lambent.viewer.modes.relight.state import RelightState
from lambent.viewer.panels import look as looks
from lambent.viewer.panels import overlay
from lambent.viewer.panels.widgets import buttons, rows, slider, typed_field, wrapped

SHORTCUTS = (
    ("left drag", "turn the sky"),
    ("Ctrl+Z, Ctrl+Shift+Z", "undo, redo a step"),
    ("Ctrl+S", "write the session now; it is saved by itself"),
    ("Ctrl+Q", "close the window"),
    ("P", "save the picture (PNG and EXR)"),
    ("H", "hide or show everything but the picture"),
)
DRAG_DEG = 0.25  # per pixel


class RelightInput(Input):
    """Input of the relight mode: the camera is fixed, a drag turns the sky."""

    def __init__(self, state: RelightState) -> None:
        low, high = state.bounds
        super().__init__(state.screen, Navigation(state.view.camera, (low, high), "walk"), state.edits)
        self._state = state

    def dragged(self, dx: float, dy: float) -> None:
        if self._state.has_sky:  # which goes with the mouse
            self._state.turn(self._state.edits.sky.turn_deg - DRAG_DEG * dx)

    def saved(self) -> None:
        self._state.keeper.save()


class RelightMode(Mode):
    """See the module."""

    def __init__(self, state: RelightState, drawing: Drawing) -> None:
        panels = (
            Panel("Sky", partial(draw_sky, state), "the light from outside: turned, or another image", opened=True),
            Panel("View", partial(looks.draw_fitted, state), "exposure and view transform", opened=True),
            Panel("Scene", partial(draw_scene, state), "the view and its light", opened=True),
            Panel("Help", partial(rows, SHORTCUTS, "shortcuts"), "mouse and keys"),
        )
        super().__init__(state.name, state.screen, RelightInput(state), drawing, panels)
        self.state, self.head = state, partial(draw_head, state)

    def advance(self, dt_s: float) -> None:
        self.state.tick()

    def wait_s(self) -> float | None:
        return self.state.keeper.wait_s()  # background work wakes the window

    def draw_over(self, textures: Textures) -> None:
        if self.state.scale is not None:
            overlay.scale_bar_of(self.screen.picture, self.state.scale, LUMINANCE.unit)
        overlay.draw(self.screen, self.state.said)
        if not imgui.is_any_item_active() and not self.input.dragging:
            self.state.edits.end_stroke()

    def drop(self, path: str) -> None:
        self.state.open(path)

    @property
    def unsaved(self) -> tuple[str, ...]:
        return self.state.keeper.unsaved

    def save(self) -> None:
        self.state.keeper.save()

    def rescue(self) -> None:
        if self.state.keeper.keeps:
            rescued("the session", self.state.keeper.rescue)
        self.state.stop_baking()


def draw_head(state: RelightState) -> None:
    """Draw the way back to the room, undo and redo, and what was wrong with the store's session."""
    edits, meaning = state.edits, "walks through the room from here, with its own sky"
    buttons([
        ("undo", edits.can_undo, edits.undo, "undoes the last step (Ctrl+Z)"),
        ("redo", edits.can_redo, edits.redo, "redoes the step (Ctrl+Shift+Z)"),
        ("walk from here", state.keeper.keeps and state.has_room, state.enter_room, meaning),
    ])  # fmt: skip
    wrapped(state.lines)


def draw_sky(state: RelightState) -> None:
    """Draw the turn of the sky, and the image that it shows."""
    sky, meaning = state.edits.sky, "rotation of the sky about the vertical; you can also drag the picture"
    imgui.begin_disabled(not state.has_sky)
    turn_deg = slider("turn", sky.turn_deg, -180.0, 180.0, meaning, digits=1, unit=" deg")
    imgui.end_disabled()
    if turn_deg != sky.turn_deg:
        state.turn(turn_deg)
    meaning = "lights the view with this image; you can also drop it onto the window"
    if (text := typed_field("sky", state.typed, "light", "an .hdr or .exr, any layout...", meaning)) is not None:
        state.open(text)
    buttons(
        [("as baked", sky.environment is not None, partial(state.light, None), "lights the view with the scene's sky")]
    )


def draw_scene(state: RelightState) -> None:
    """Draw what the picture is of."""
    width, height = state.size
    image, own = state.edits.sky.environment, "the scene's" if state.has_sky else "none"
    rows(
        [("camera", state.view.camera.name), ("picture", f"{width} x {height}"),
         ("sky", own if image is None else image.file.rpartition("/")[2]),
         ("light", "direct, with shadows")], "scene"
    )  # fmt: skip
