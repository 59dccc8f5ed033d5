"""The window's view as its session keeps it, and the way back."""

from __future__ import annotations

from collections.abc import Collection
from functools import partial
from typing import TYPE_CHECKING

from pydantic import ValidationError

from lambent.core.errors import UserError
from lambent.realtime.planar.planar_integrators import CHOICES as PLANARS
from lambent.store.kept.session import KeptLook, KeptView
from lambent.viewer.cameras.navigation import Movement
from lambent.viewer.look import INTEGRATORS, LOOKUPS, SHOWS, VIEW_TRANSFORMS, Look

if TYPE_CHECKING:
    from lambent.viewer.modes.walk.state import WalkState

CHOICES = {
    "view_transform": VIEW_TRANSFORMS, "integrator": INTEGRATORS, "show": SHOWS, "lookup": LOOKUPS, "planar": PLANARS,
}  # fmt: skip


def view_of(state: WalkState) -> KeptView | None:
    """The view that a window shows; the opened one while a number is beyond what a session may have."""
    try:
        return _view_of(state)
    except (UserError, ValidationError):
        return state.session.opened.view


def _view_of(state: WalkState) -> KeptView:
    navigation, place, look = state.navigation, state.screen.picture, state.look
    kept = {name: getattr(look, name) for name in KeptLook.model_fields} | {"lookups": dict(look.lookups)}
    if state.meter.expose_wanted:  # no exposure yet
        kept |= {"exposure_ev": None, "base_ev": None}
    return KeptView(
        camera=navigation.camera, movement=navigation.movement, flying=navigation.flying,
        speed_m_s=navigation.walker.speed_m_s or None, eye_height_m=navigation.walker.eye_height_m or None,
        size=(max(1, place.width), max(1, place.height)),
        look=KeptLook(**kept),
        traces=state.screen.pace.traces, light_follows=state.answering.on, rebaked=state.rebaking.copied,
        split=state.states.split, selected=state.selection.name,
    )  # fmt: skip


def restore(state: WalkState) -> tuple[str, ...]:
    """Show the view of the opened session, and keep it from now on; return lines as `show_view`."""
    lines = show_view(state, state.session.opened.view)
    state.session.view = partial(view_of, state)
    return lines


def show_view(state: WalkState, view: KeptView | None) -> tuple[str, ...]:
    """Show a view; return lines on what this version or store lacks. Orbit stays if it was asked for."""
    if view is None:
        return ()
    navigation, walker = state.navigation, state.navigation.walker
    navigation.camera, navigation.flying = view.camera, view.flying
    navigation.movement = _movement(navigation.movement, view.movement)
    walker.speed_m_s = view.speed_m_s or walker.speed_m_s
    walker.eye_height_m = view.eye_height_m or walker.eye_height_m
    state.screen.pace.traces, state.answering.on = view.traces, view.light_follows
    state.states.split = view.split and state.materials.edits.other is not None
    if view.selected in [one.name for one in state.selection.objects]:
        state.selection.choose(view.selected)
    state.meter.expose_wanted = view.look.exposure_ev is None
    lines = show_look(state.look, view.look, {o.name for o in state.scene.objects})
    if state.look.is_false_coloured:
        state.meter.fitted.add(state.look.shows_noise)  # its range is the session's
    return lines


def _movement(asked: Movement, kept: Movement) -> Movement:
    return asked if asked == "orbit" else kept


def show_look(look: Look, kept: KeptLook, objects: Collection[str]) -> tuple[str, ...]:
    """Set the look; return lines on methods that this version lacks."""
    unknown = [name for name, choices in CHOICES.items() if getattr(kept, name) not in choices]
    for name in set(KeptLook.model_fields) - {*unknown, "lookups", "exposure_ev", "base_ev"}:
        setattr(look, name, getattr(kept, name))
    look.lookups = {name: how for name, how in kept.lookups.items() if name in objects and how in LOOKUPS}
    if kept.exposure_ev is not None:
        look.expose(kept.base_ev if kept.base_ev is not None else kept.exposure_ev)
        look.exposure_ev = kept.exposure_ev
    return tuple(f"the session's {name} is not known here: {getattr(kept, name)}" for name in unknown)
