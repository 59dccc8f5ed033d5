"""The States panel: store the room's state, apply a stored state, show two states side by side."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.core.errors import UserError
from lambent.store.kept.session import RoomState
from lambent.viewer.modes.walk.session.states import BAKED, States
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.panels.widgets import check, path_field, press

HINT = "name of this state..."


def draw(state: WalkState) -> None:
    states = state.states
    meaning = "stores the present materials and light under this name; replaces a state of the same name"
    states.typed_name, wanted = path_field("state name", states.typed_name, "store", HINT, meaning)
    if wanted:
        try:
            states.store()
        except UserError as error:
            state.screen.say(str(error))
    for name, room in states.all.items():
        _row(states, name, room, name)
        if name != BAKED:
            imgui.same_line()
            if press(f"x##{name}", f"deletes the stored state {name}; undo restores it", small=True):
                states.edits.forget(name)
    if variants := states.variants:
        imgui.separator_text("variants of the scene")
        for name, room in variants.items():
            _row(states, name, room, f"variant {name}")
        imgui.separator()
    split = check("split view", states.split, "shows the room left of a divider and another state right of it")
    if split != states.split:
        states.split = split
    if states.split and state.comparison.on:
        state.comparison.mode = "off"  # a picture has only one divider
    imgui.same_line()
    if press("swap", "swaps the room with the state beside it (X)"):
        states.exchange()


def _row(states: States, name: str, room: RoomState, own: str) -> None:
    """Draw a state with its buttons, whose ids end with `own`."""
    edits = states.edits
    if press(f"apply##{own}", f"sets the room to '{name}'; undo restores the room", small=True):
        edits.take(room)
    imgui.same_line()
    if press(f"split##{own}", f"shows the room and '{name}' side by side", small=True):
        states.split_with(room)
    imgui.same_line()
    marks = [mark for mark, here in (("now", edits.room == room), ("beside", edits.other == room)) if here]
    imgui.text_unformatted(f"{name}  ({', '.join(marks)})" if marks else name)
