"""Lines above all panels: undo and redo, whether the session is kept, and how exact the light of the edited room is."""

from __future__ import annotations

from functools import partial

from imgui_bundle import imgui

from lambent.viewer.modes.walk.session.leaving import can_leave, edit_view, relight_view
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.panels.widgets import buttons, check, status, wrapped

# Usual texts at their longest, on estimated light and on a bake: they reserve the height of their lines.
LONGEST = (
    "indirect light: estimated, error up to 10.0 %",
    "baking again 10:00 (first bake 10:00): light map, gathered 100 %; new light on 100 of 100 objects",
)


def draw(state: WalkState) -> None:
    edits, session = state.materials.edits, state.session
    buttons([
        ("undo", edits.can_undo, edits.undo, "undoes the last change of a material or the light (Ctrl+Z)"),
        ("redo", edits.can_redo, edits.redo, "redoes the change (Ctrl+Shift+Z)"),
        ("edit this view", can_leave(state), partial(edit_view, state),
         "pulls the curves of the materials in this view, under exact direct light"),
        ("relight this view", can_leave(state), partial(relight_view, state),
         "turns the sky of this view, or exchanges it: direct light with shadows"),
    ])  # fmt: skip
    if session.fault:
        wrapped([session.fault])
    if state.screen.size == "measure":
        _light(state)
    else:
        status([state.rebaking.line if state.rebaking.said else state.answering.said], LONGEST[:1])


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
