"""Edits of materials and light in the window: undo and redo, file names, rescue of unsaved work."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from lambent.core.errors import UserError
from lambent.core.light.light_mix import LightMix, MixTrack
from lambent.core.plain import Triple, plain_name
from lambent.editing.session.document import SessionDocument
from lambent.editing.session.history import History
from lambent.editing.session.session import with_materials
from lambent.materials.document import Material
from lambent.scenes.lamp_edits import LampEdit
from lambent.scenes.scene import ImageTexture
from lambent.store.kept.session import RelitSky, RoomState, WalkSession


@dataclass(frozen=True)
class _State:
    """The present room, the room it is compared with, stored rooms, and data kept with materials, by name."""

    room: RoomState = field(default_factory=RoomState)
    other: RoomState | None = None
    stored: Mapping[str, RoomState] = field(default_factory=dict)
    notes: Mapping[str, Hashable] = field(default_factory=dict)
    tracks: Mapping[str, MixTrack | None] = field(default_factory=dict)  # light along paths that was changed, by path
    views: Mapping[str, SessionDocument] = field(default_factory=dict)  # edited in place, by camera
    sky: RelitSky = field(default_factory=RelitSky)


class MaterialEdits:
    """Changed materials, light mix, and light along paths, with one shared undo and redo.

    A stroke is one drag of a slider: any number of changes, then one `end_stroke`. Undo takes it back as a whole.

    Attributes
    ----------
    scene
        The materials of the scene, by name.
    saved
        Materials as last saved as documents.
    """

    def __init__(self, scene: Mapping[str, Material]) -> None:
        self.scene = scene
        self.saved: dict[str, Material] = {}
        self._history: History[_State] = History(_State())
        self._first_tracks: dict[str, MixTrack | None] = {}  # by path, before the first change

    @property
    def edited(self) -> Mapping[str, Material]:
        """The materials that differ from the scene's."""
        return self.room.materials

    @property
    def light(self) -> LightMix:
        """The mix of light groups."""
        return self.room.light

    @property
    def room(self) -> RoomState:
        """The present state of the room."""
        return self._history.now.room

    @property
    def other(self) -> RoomState | None:
        """The state of the room that the present one is compared with, if any."""
        return self._history.now.other

    @property
    def stored(self) -> Mapping[str, RoomState]:
        """States of the room that were stored, by name."""
        return self._history.now.stored

    @property
    def session(self) -> WalkSession:
        """The whole session to save."""
        return WalkSession(now=self.room, beside=self.other, states=dict(self.stored), sky=self.sky)

    def current(self, name: str) -> Material:
        return self.edited.get(name, self.scene[name])

    def change(self, name: str, material: Material) -> None:
        """Change a material within the present stroke, or begin a stroke."""
        self._go_on(room=self._room(self.room.model_copy(update={"materials": {**self.edited, name: material}})))

    @property
    def views(self) -> Mapping[str, SessionDocument]:
        """Views edited in place, by their camera's name; their materials are those of the room."""
        return self._history.now.views

    def in_room(self, view: SessionDocument) -> SessionDocument:
        """A view with the room's materials; those that the scene does not have stay."""
        return with_materials(view, {name: self.current(name) for name in view.materials if name in self.scene})

    def change_view(self, view: SessionDocument) -> None:
        """Change a view, and the room's materials to those of the view, within the present stroke, or begin one."""
        now = {name: one.now for name, one in view.materials.items()}
        room = self._room(self.room.model_copy(update={"materials": {**self.edited, **now}}))
        self._go_on(room=room, views={**self.views, view.camera.name: view})

    @property
    def sky(self) -> RelitSky:
        """The light of relit views."""
        return self._history.now.sky

    def change_sky(self, **changes: object) -> None:
        """Change the light of relit views within the present stroke, or begin a stroke."""
        if (sky := self.sky.model_copy(update=changes)) != self.sky:
            self._go_on(sky=sky)

    def mix(self, light: LightMix) -> None:
        """Change the light mix within the present stroke, or begin a stroke."""
        if light != self.light:
            self._go_on(room=self.room.model_copy(update={"light": light}))

    def edit_lamp(self, number: int, edit: LampEdit | None) -> None:
        """Move, aim or exchange a lamp, None for as baked, within the present stroke, or begin a stroke."""
        others = {other: one for other, one in self.room.lamps.items() if other != number}
        self._go_on(room=self.room.model_copy(update={"lamps": others if edit is None else {**others, number: edit}}))

    def take(self, room: RoomState) -> None:
        """Set the state of the whole room as one stroke; ignore materials that the scene does not have."""
        self._step(room=self._room(room))

    def set_texture(self, name: str, of: str | ImageTexture | None, kd: Triple | None) -> None:
        """Show a texture on a material, None for its own, and set its diffuse colour unless None, as one stroke."""
        material = self.current(name) if kd is None else self.current(name).model_copy(update={"kd": kd})
        self.end_stroke()
        self.show_texture(name, of)
        self.change(name, material)
        self.end_stroke()

    def show_texture(self, name: str, of: str | ImageTexture | None) -> None:
        """Show a texture on a material, None for its own, within the present stroke, or begin a stroke."""
        others = {other: used for other, used in self.room.textures.items() if other != name}
        textures = others if of is None else {**others, name: of}
        self._go_on(room=self._room(self.room.model_copy(update={"textures": textures})))

    def set_materials(self, materials: Mapping[str, Material]) -> None:
        """Set several materials with their textures as one stroke."""
        textures = {name: of for name, of in self.room.textures.items() if name not in materials}
        update = {"materials": {**self.edited, **materials}, "textures": textures}
        self._step(room=self._room(self.room.model_copy(update=update)))

    def compare_with(self, other: RoomState | None) -> None:
        """Compare the room with this state from now on, as one stroke."""
        self._step(other=other)

    def exchange(self) -> None:
        """Swap the present state with the one it is compared with, as one stroke."""
        if (other := self.other) is not None:
            self._step(room=self._room(other), other=self.room)

    def store(self, name: str) -> None:
        """Store the present state under a name, replacing a state of that name, as one stroke."""
        self._step(stored={**self.stored, name: self.room})

    def forget(self, name: str) -> None:
        """Delete a stored state, as one stroke."""
        self._step(stored={other: room for other, room in self.stored.items() if other != name})

    def _room(self, room: RoomState) -> RoomState:
        """The part of a state that the scene has and that differs from the scene."""
        known = room.only(self.scene)
        changed = {name: one for name, one in known.materials.items() if one != self.scene[name]}
        return known.model_copy(update={"materials": changed})

    @property
    def tracks(self) -> Mapping[str, MixTrack | None]:
        """The present light along each path whose light was changed."""
        return {**self._first_tracks, **self._history.now.tracks}

    def light_path(self, path: str, before: MixTrack | None, track: MixTrack | None) -> None:
        """Change the light along a path from `before`, as one stroke."""
        self._first_tracks.setdefault(path, before)
        self._step(tracks={**self._history.now.tracks, path: track})

    def note_of(self, name: str) -> Hashable:
        """Data kept with a material; None without."""
        return self._history.now.notes.get(name)

    def keep_note(self, name: str, value: Hashable) -> None:
        """Keep data with a material, such as restrictions of a fit; undo restores the data of before."""
        self._go_on(notes={**self._history.now.notes, name: value})

    def _step(self, **changes: Any) -> None:
        self.end_stroke()
        self._go_on(**changes)
        self.end_stroke()

    def _go_on(self, **changes: Any) -> None:
        if not self.in_stroke:
            self._history.begin_stroke()
        self._history.change(replace(self._history.now, **changes))

    def end_stroke(self) -> None:
        self._history.end_stroke()

    def begin_from(self, session: WalkSession, views: Mapping[str, SessionDocument] = MappingProxyType({})) -> None:
        """Start a new history from a saved session, with its views; earlier steps cannot be undone."""
        self._history = History(replace(self._state_of(session), tracks=self.tracks, views=views))

    @property
    def history(self) -> History[_State]:
        """All steps, for `resume`."""
        return self._history

    def resume(self, history: History[_State]) -> None:
        """Go on with the steps of earlier edits, to the present state, as one more stroke if it differs."""
        now, self._history = self._history.now, history
        kept = history.now
        self._history.change(replace(now, notes=kept.notes, tracks=kept.tracks, views=kept.views))

    def go_to(self, session: WalkSession) -> None:
        """Take a whole session, as one stroke."""
        self.end_stroke()
        now = self._history.now
        self._history.change(
            replace(self._state_of(session), notes=now.notes, tracks=self.tracks, views=now.views, sky=now.sky)
        )

    def _state_of(self, session: WalkSession) -> _State:
        return _State(self._room(session.now), session.beside, session.states, sky=session.sky)

    def reset(self, name: str) -> None:
        """Restore the scene's material, as one stroke."""
        self.set_materials({name: self.scene[name]})

    @property
    def in_stroke(self) -> bool:
        """Whether a stroke is in progress."""
        return self._history.in_stroke

    def previous(self, name: str) -> Material | None:
        """The material before the last or present stroke; None without one."""
        before = self._history.previous
        return None if before is None else before.room.materials.get(name, self.scene[name])

    @property
    def can_undo(self) -> bool:
        return self._history.can_undo

    @property
    def can_redo(self) -> bool:
        return self._history.can_redo

    def undo(self) -> None:
        self._history.undo()

    def redo(self) -> None:
        self._history.redo()


def rescue(edits: MaterialEdits, names: Iterable[str], folder: Path) -> Iterator[Path]:
    """Write materials to new files, because the window is about to be lost."""
    for name in names:
        material = edits.current(name)
        file = rescue_file(folder, material.name or name)
        material.save(file)
        yield file


def rescue_file(folder: Path, name: str) -> Path:
    """A new file name for unsaved work."""
    return folder / f"{unused(folder, f'{plain_name(name)}-rescued', '.json')}.json"


def file_in(folder: Path, name: str) -> Path:
    """The file for a name or path, in `folder` if relative; `UserError` if it cannot be written."""
    file = folder / Path(name).expanduser()
    if not file.parent.is_dir():
        raise UserError("folder does not exist", file=file.parent)
    if file.is_dir():
        raise UserError("is a folder", file=file)
    return file


def unused(folder: Path, stem: str, *suffixes: str) -> str:
    """`stem-001`, or `stem` with the first number that no file of these suffixes in `folder` has."""
    number = 1
    while any((folder / f"{stem}-{number:03}{suffix}").exists() for suffix in suffixes):
        number += 1
    return f"{stem}-{number:03}"
