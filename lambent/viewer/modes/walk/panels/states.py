"""The States panel: store the room as it is, go back to a stored state, show two beside each other."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.core.errors import UserError
from lambent.store.session import RoomState
from lambent.viewer.modes.walk.comparison import Comparison
from lambent.viewer.modes.walk.states import BAKED, States
from lambent.viewer.panels.widgets import check, path_field, press
from lambent.viewer.screen import Screen

HINT = "name of this state..."


def draw(states: States, comparison: Comparison, screen: Screen) -> None:
    meaning = "keeps materials and light as they are now under this name; a name that is there gets them instead"
    states.typed_name, wanted = path_field("state name", states.typed_name, "store", HINT, meaning)
    if wanted:
        try:
            states.store()
        except UserError as error:
            screen.say(str(error))
    for name, room in states.all.items():
        _row(states, name, room, name)
        if name != BAKED:
            imgui.same_line()
            if press(f"x##{name}", f"drops the stored state {name}; undo brings it back", small=True):
                states.edits.forget(name)
    if variants := states.variants:
        imgui.separator_text("variants of the scene")
        for name, room in variants.items():
            _row(states, name, room, f"variant {name}")
        imgui.separator()
    split = check("split view", states.split, "shows the room left of a divider, and the other state right of it")
    if split != states.split:
        states.split = split
    if states.split and comparison.on:
        comparison.mode = "off"  # of two integrators: a picture has one divider
    imgui.same_line()
    if press("exchange", "the room and the state beside it change places (X)"):
        states.exchange()


def _row(states: States, name: str, room: RoomState, own: str) -> None:
    """A state: take it, or compare with it; `own` tells its buttons from others."""
    edits = states.edits
    if press(f"take##{own}", f"shows {name} and goes on from it; undo brings back the room as it was", small=True):
        edits.take(room)
    imgui.same_line()
    if press(f"beside##{own}", f"shows the room and {name} beside each other", small=True):
        states.show_beside(room)
    imgui.same_line()
    marks = [mark for mark, here in (("now", edits.room == room), ("beside", edits.other == room)) if here]
    imgui.text_unformatted(f"{name}  ({', '.join(marks)})" if marks else name)
