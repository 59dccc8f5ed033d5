"""The way from the room to one of its views, edited in place or relit."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from lambent.core.views.camera import Camera
from lambent.viewer.exchange import EDIT, RELIGHT, WALK, exchanged
from lambent.viewer.modes.walk.state import WalkState


def can_leave(state: WalkState) -> bool:
    """Whether a view of the room can be baked and its session goes on there."""
    return state.session.keeps and state.rebaking.possible


def edit_view(state: WalkState) -> None:
    """Edit what the camera sees in place; it becomes a saved view unless it is a camera already."""
    _enter(state, EDIT)


def relight_view(state: WalkState, sky: Path | None = None) -> None:
    """Relight what the camera sees, likewise, under an image as its sky if one is given."""
    _enter(state, RELIGHT, **({} if sky is None else {"environment": {"path": sky}}))


def _enter(state: WalkState, name: str, **options: Any) -> None:
    store, busy = state.store, state.films.under_way is not None
    lost = ("the film", *state.session.unsaved) if busy else state.session.unsaved
    lost = (*lost, "the recorded walk") if state.recordings.unsaved else lost
    if lost or store is None:
        state.screen.say(f"stays here: save or end first: {', '.join(lost)}")
        return
    state.navigation.path = None
    if (camera := _named(state)) is not None:
        state.navigation.camera = camera
        place = state.screen.picture
        fitting = place.width, place.height
        state.screen.enter = partial(
            exchanged, store=store, before=WALK, name=name, camera=camera.name, fitting=fitting, **options
        )


def _named(state: WalkState) -> Camera | None:
    """The camera of the room at this place; a new saved view without one, None if that fails."""
    there = state.navigation.camera
    same = (one for one in state.recordings.cameras if replace(one, name=there.name) == there)
    if (found := next(same, None)) is not None:
        return found
    state.recordings.save_view()
    return state.navigation.camera if state.navigation.camera in state.recordings.cameras else None
