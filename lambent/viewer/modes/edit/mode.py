"""The edit mode: its panels, its input, and the overlays of the picture."""

from __future__ import annotations

from functools import partial
from typing import Any

from imgui_bundle import imgui

from lambent.core.light.photometry import LUMINANCE
from lambent.viewer.background.lost import rescued
from lambent.viewer.background.work import POLL_S
from lambent.viewer.cameras.navigation import Navigation
from lambent.viewer.input import Input
from lambent.viewer.mode import Drawing, Mode, Panel, Textures
from lambent.viewer.modes.edit import panels
from lambent.viewer.modes.edit.bounced_panel import draw_interreflections
from lambent.viewer.modes.edit.state import OUTLINED_S, EditState
from lambent.viewer.panels import look as looks
from lambent.viewer.panels import overlay
from lambent.viewer.panels.curves import CurvesPanel
from lambent.viewer.panels.widgets import rows, shadowed
from lambent.viewer.screen import least

SHORTCUTS = (
    ("click", "edit the material under the mouse"),
    ("Tab", "the next material"),
    ("Ctrl+Z, Ctrl+Shift+Z", "undo, redo a step"),
    ("Ctrl+S", "save the session"),
    ("Ctrl+Q", "close the window"),
    ("P", "save the picture (PNG and EXR)"),
    ("H", "hide or show everything but the picture"),
)
LOOK_S = 0.02  # interval of polling for a frame while the picture changes


class EditInput(Input):
    """Input of the edit mode: the camera is fixed, the mouse points at materials."""

    def __init__(self, state: EditState) -> None:
        bounds: Any = tuple(map(tuple, state.subject.scene.bounds))
        camera = state.session.document.camera
        super().__init__(state.screen, Navigation(camera, bounds, "walk"), state.subject.edits)
        self._state = state

    def dragged(self, dx: float, dy: float) -> None:
        """Ignore drags: the camera is fixed."""

    def pointed(self, at: tuple[float, float] | None) -> None:
        view = self._state.loading.view
        self._state.pointed = view.at(*at) if at is not None and view is not None else None

    def clicked(self, x: float, y: float) -> None:
        place, view = self.screen.picture, self._state.loading.view
        found = view.at(x / place.width, y / place.height) if view is not None else None
        if found is not None:
            self._state.select(found[1])

    def pressed_key(self, key: str) -> None:
        if key == "Tab" and self._state.materials:
            self._state.select_next()

    def saved(self) -> None:
        self._state.files.save()


class EditMode(Mode):
    """See the module."""

    def __init__(self, state: EditState, drawing: Drawing) -> None:
        super().__init__(state.subject.name, state.screen, EditInput(state), drawing, columns(state))
        self.state = state
        if state.subject.keeper is not None:
            self.head = partial(panels.draw_head, state, state.subject.keeper)

    @property
    def moving(self) -> bool:
        return self.state.painter.busy

    def advance(self, dt_s: float) -> None:
        self.state.tick()

    def wait_s(self) -> float | None:
        state = self.state
        return least(
            POLL_S if state.busy else None,
            LOOK_S if state.painter.busy else None,
            OUTLINED_S / 2 if state.selection_is_new else None,
            state.files.keeper.wait_s() if state.files.keeper is not None else None,
        )

    def draw_over(self, textures: Textures) -> None:
        state, place = self.state, self.screen.picture
        overlay.over(place, textures.get("outline") if state.outlined else None)
        if state.pointed is not None:
            x, y = imgui.get_mouse_pos()
            shadowed(imgui.get_background_draw_list(), (x + 14, y + 4), state.pointed[1], (1, 1, 1, 1))
        if state.scale is not None:
            overlay.scale_bar_of(place, state.scale, LUMINANCE.unit)
        overlay.draw(self.screen, self._lines())
        if not imgui.is_any_item_active():
            state.subject.edits.end_stroke()

    def _lines(self) -> list[str]:
        """Lines on background work and its errors."""
        state = self.state
        fault = "" if state.files.keeper is None else state.files.keeper.fault
        lines = [line for line in (fault, state.trouble, state.painter.notice) if line]
        if state.baking is not None:
            lines.append(state.baking.line)
        elif state.loading.busy:
            lines.append("reading transport")
        if state.bounced.line:
            lines.append(state.bounced.line)
        if state.files.fitting.busy:
            lines.append(state.files.fitting.doing)
        frame = state.painter.frame
        if frame is not None and frame.needed:
            lines.append(f"waiting for transport, shown without the edit: {', '.join(sorted(frame.needed))}")
        return lines

    def drop(self, path: str) -> None:
        self.state.files.open(path, self.state.material)

    @property
    def unsaved(self) -> tuple[str, ...]:
        return ("the session",) if self.state.files.unsaved else ()

    def save(self) -> None:
        self.state.files.save()

    def rescue(self) -> None:
        rescued("the session", self.state.files.rescue)
        self.state.stop_baking()

    def close(self) -> None:
        self.state.files.name_unsaved()


def columns(state: EditState) -> tuple[Panel, ...]:
    """Panels of the column."""
    curves = CurvesPanel(lambda: state.selected, state.subject.edits, state.change, state.screen, state.files.fitting)
    return (
        Panel(
            "Material",
            partial(panels.draw_material, state),
            "the selected material",
            opened=True,
        ),
        Panel("Curves", curves.draw, "pull the curves of the material", opened=True),
        Panel("Numbers", panels.Numbers(state).draw, "every parameter of the material"),
        Panel("View", partial(looks.draw_fitted, state), "exposure and view transform", opened=True),
        Panel(
            "Compare", partial(panels.draw_compare, state), "the picture compared with an earlier state", opened=True
        ),
        Panel(
            "Save",
            partial(panels.draw_files, state),
            "save the session, or the material as a document",
            opened=True,
        ),
        Panel(
            "Interreflections",
            partial(draw_interreflections, state.bounced, state.session.merge),
            "light between surfaces",
        ),
        Panel("Scene", partial(panels.draw_scene, state), "the view, its light, and its transport", opened=True),
        Panel("Help", partial(rows, SHORTCUTS, "shortcuts"), "mouse and keys"),
    )
