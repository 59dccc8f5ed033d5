"""Lines above all panels: undo and redo, saving the session, and how exact the light of the edited room is."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.panels.widgets import buttons, check, status

# Usual texts at their longest, on estimated light and on a bake: they reserve the height of their lines.
LONGEST = (
    "indirect light: estimated, error up to 10.0 %",
    "baking again 10:00 (first bake 10:00): light map, gathered 100 %; new light on 100 of 100 objects",
)


def draw(state: WalkState) -> None:
    edits, session = state.materials.edits, state.session

    def save() -> None:
        session.save()

    what = session.fault or "saves materials, light and stored states in the store; the next window starts with them"
    buttons([
        ("undo", edits.can_undo, edits.undo, "undoes the last change of a material or the light (Ctrl+Z)"),
        ("redo", edits.can_redo, edits.redo, "redoes the change (Ctrl+Shift+Z)"),
        ("save session", not session.fault, save, f"{what} (Ctrl+S)"),
    ])  # fmt: skip
    if session.unsaved:
        imgui.same_line()
        imgui.text_disabled("unsaved")
    _light(state)


def _light(state: WalkState) -> None:
    """Draw whether light on other surfaces follows edits, estimated or rebaked, and how exact it is."""
    answering, rebaking = state.answering, state.rebaking
    if answering.possible:
        meaning = "estimates at once how edited materials change the light on other surfaces"
        answering.on = check("light follows", answering.on, meaning)
        imgui.same_line()
    if rebaking.possible:
        meaning = "bakes the light of edited materials again in the background and updates the picture"
        rebaking.on = check("bake edits", rebaking.on, meaning)
    lines = [rebaking.line if rebaking.said else answering.note]
    if rebaking.possible:
        lines.append("" if rebaking.said else rebaking.line)
    status(lines, LONGEST[: len(lines)])
