"""What the bar and the buttons of a gamepad offer: variants, light, views and films, each a list of names to choose."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

from lambent.store.kept.session import RoomState
from lambent.viewer.modes.walk.session.states import States
from lambent.viewer.modes.walk.state import WalkState


@dataclass(frozen=True)
class Offers:
    """A list: what each name does, and the name `now`; another text where none of them is now."""

    title: str
    meaning: str
    acts: Mapping[str, Callable[[], None]]
    now: str

    def next(self) -> str | None:
        """Choose the name after the present one, or the first; return it, None for an empty list."""
        names = list(self.acts)
        if not names:
            return None
        name = names[(names.index(self.now) + 1) % len(names)] if self.now in names else names[0]
        self.acts[name]()
        return name


def variants(states: States) -> Offers:
    """The room as baked, its variants, and its stored states."""
    rooms = {**states.all, **states.variants}
    acts = {name: partial(states.edits.take, room) for name, room in rooms.items()}
    return Offers("variant", "the room as baked, its variants, stored states", acts, _now(states, rooms))


def lights(states: States) -> Offers:
    """The light and the lamps of each room whose light differs from the ones before."""
    room, lit = states.edits.room, dict[str, RoomState]()
    for name, one in {**states.all, **states.variants}.items():
        changed = room.model_copy(update={"light": one.light, "lamps": one.lamps})
        if changed not in lit.values():
            lit[name] = changed
    acts = {name: partial(states.edits.take, room) for name, room in lit.items()}
    return Offers("light", "the light alone of variants and stored states", acts, _now(states, lit))


def _now(states: States, rooms: Mapping[str, RoomState]) -> str:
    return next((name for name, room in rooms.items() if room == states.edits.room), "as edited")


def views(state: WalkState) -> Offers:
    """Cameras of the scene, and saved views."""
    recordings, camera = state.recordings, state.navigation.camera
    acts = {one.name: partial(recordings.visit, one) for one in recordings.cameras}
    now = next((one.name for one in recordings.cameras if one == camera), "free")
    return Offers("view", "cameras of the scene, saved views", acts, now)


def films(state: WalkState) -> Offers:
    """Camera paths, each shown from its beginning."""
    navigation = state.navigation
    acts = {one.name: partial(navigation.scrub, one, 0.0) for one in state.recordings.paths}
    now = navigation.path.path.name if navigation.path else next(iter(acts), "")
    return Offers("film", "camera paths of the scene, recorded walks", acts, now)
