"""Above all panels: undo and redo, saving the session, and how exact the light of the edited room is."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.panels.widgets import buttons, check, explain


def draw(state: WalkState) -> None:
    edits, session = state.materials.edits, state.session

    def save() -> None:
        session.save()

    what = session.fault or "keeps materials, light and stored states with the store; the next window begins with them"
    buttons([
        ("undo", edits.can_undo, edits.undo, "takes back the last change of a material or the light (Ctrl+Z)"),
        ("redo", edits.can_redo, edits.redo, "does the change again (Ctrl+Shift+Z)"),
        ("save session", not session.fault, save, f"{what} (Ctrl+S)"),
    ])  # fmt: skip
    if session.unsaved:
        imgui.same_line()
        imgui.text_disabled("unsaved")
    _light(state)


def _light(state: WalkState) -> None:
    """How exact the light of other surfaces is in one line, and whether it follows an edit, at once and exactly."""
    answering, rebaking = state.answering, state.rebaking
    if answering.possible:
        meaning = "other surfaces get the light of edited colours, estimated at once"
        answering.on = check("light answers", answering.on, meaning)
        imgui.same_line()
    if rebaking.possible:
        meaning = "bakes the light of edited materials anew beside the window, and brings it into the picture"
        rebaking.on = check("bake edits", rebaking.on, meaning)
    for line in ("" if rebaking.exact else answering.note, rebaking.line):
        if line:
            imgui.text_disabled(line)
            explain(line)
