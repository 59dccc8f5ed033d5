"""The session of a room in the window: its edits and its view, in the store's session file."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path

from lambent.core.errors import UserError
from lambent.editing.session.document import SessionDocument, document_from
from lambent.editing.session.session import Session
from lambent.store.kept.images import names_of_images, readable, remove_unused
from lambent.store.kept.session import FILE, FORMER_BACKUP, EditedView, KeptView, WalkSession, read_session
from lambent.store.kept.states import images_of_variants
from lambent.viewer.edits.edits import MaterialEdits
from lambent.viewer.edits.session_file import SOON_S, SessionFile, moved_aside
from lambent.viewer.screen import Screen

BACK = "unsaved changes of an earlier window are restored: undo takes them back"


class SessionKeeper(SessionFile):
    """The session file of one store, with the `edits` of its room and its present `view`."""

    def __init__(self, edits: MaterialEdits, folder: Path | None, screen: Screen, soon_s: float = SOON_S) -> None:
        super().__init__(folder, screen, soon_s)
        self._edits = edits
        self.view: Callable[[], KeptView | None] = lambda: None
        self._foreign: dict[str, object] = {}  # materials of the present state that the store lacks
        self._sections: dict[str, tuple[tuple[object, object], EditedView]] = {}

    def open(self, groups: Collection[str] | None = (), *, fresh: bool = False) -> tuple[str, ...]:
        """Open the session of the store; return lines on problems. `fresh` begins with the store as baked.

        `groups` are names of the store's light groups; None: whatever the session names.
        """
        if self._folder is None:
            return ()
        lines = self.read(self._folder, fresh=fresh)
        self._edits.begin_from(self.opened, self._views())
        if (history := self._screen.histories.pop(self._folder, None)) is not None:
            self._edits.resume(history)
        if not self.fault and not fresh:
            lines += self._take_former_backup(self._folder / FORMER_BACKUP)
        session = self._edits.session
        if groups is None:
            groups = {name for room in (*self.opened.rooms, *session.rooms) for name in room.light.groups}
        self._foreign = {k: v for k, v in self.opened.now.materials.items() if k not in self._edits.scene}
        if unknown := sorted(
            {*self.opened.unknown(self._edits.scene, groups), *session.unknown(self._edits.scene, groups)}
        ):
            lines.append(f"the session has {', '.join(unknown)}, which the store lacks: kept, not shown")
        faults = (readable(room.textures, self._folder)[1] for room in session.rooms)
        lines += dict.fromkeys(fault for of_room in faults for fault in of_room)
        return tuple(lines)

    def _views(self) -> dict[str, SessionDocument]:
        """The session's edited views that can be used as they are; the mode that opens another one says why not."""
        found = {}
        for name, view in self.opened.edited.items():
            try:
                if view.document.get("version") != 1:
                    found[name] = document_from(view.document, (self._folder or Path()) / FILE)
            except UserError:
                continue
        return found

    def _take_former_backup(self, file: Path) -> list[str]:
        """Take the unsaved changes that a window of version 1 left; the file goes with the next write."""
        try:
            unsaved = read_session(file)
        except UserError as error:
            kept = moved_aside(file)
            return [f"unsaved changes of an earlier window cannot be read ({error}); the file is now {kept.name}"]
        if unsaved is None:
            return []
        self._edits.go_to(unsaved)
        self._written, self._spent = None, file
        return [BACK] if self._edits.can_undo else []

    @property
    def session(self) -> WalkSession:
        edited = {name: self._section(name, view) for name, view in self._edits.views.items()}
        changes = {"view": self.view() or self.opened.view, "edited": {**self.opened.edited, **edited}}
        session = self._edits.session.model_copy(update=changes)
        if not self._foreign:
            return session
        now = session.now.model_copy(update={"materials": {**self._foreign, **session.now.materials}})
        return session.model_copy(update={"now": now})

    def _section(self, name: str, view: SessionDocument) -> EditedView:
        """A view edited in place, as the store has it: its files by the store's folder, also of a store that moves."""
        of = view, self._edits.edited
        made = self._sections.get(name)
        if made is None or any(a is not b for a, b in zip(of, made[0], strict=True)):
            folder = self._folder or Path()
            whole = Session(self._edits.in_room(view), folder).placed(folder).model_copy(update={"scene": "."})
            made = self._sections[name] = of, EditedView(document=whole.model_dump(mode="json"))
        return made[1]

    @property
    def unsaved(self) -> tuple[str, ...]:
        """Names of edits that are lost with this window, for people; materials by name."""
        if not self.fault:
            return ()
        edits, kept = self._edits, self.kept
        names = [name for name in edits.scene if not self._is_saved(name)]
        now, textures = edits.room.textures, kept.now.only(edits.scene).textures
        more = [
            *((f"the texture of {name}", now.get(name) != textures.get(name)) for name in edits.scene),
            ("the lamps", edits.room.lamps != kept.now.lamps),
            ("the light mix", edits.light != kept.now.light),
            ("stored states", edits.stored != kept.states),
            ("the state to compare with", edits.other != kept.beside),
            ("the sky of relit views", edits.sky != kept.sky),
        ]
        return (*names, *(what for what, changed in more if changed))

    def _is_saved(self, name: str) -> bool:
        """Whether a material equals that of the session on disk, or its last saved document."""
        now = self._edits.current(name)
        return now in (self.kept.now.materials.get(name, self._edits.scene[name]), self._edits.saved.get(name))

    def save(self) -> bool:
        self._edits.end_stroke()
        return super().save()

    def close(self) -> None:
        """Write the session, release it to another window, and delete images that no session uses."""
        self._write_now()
        if self._folder is not None and self._screen.exchanging:
            self._screen.histories[self._folder] = self._edits.history
        elif self._folder is not None and self.keeps:
            self._remove_images(self._folder)
        super().close()

    def _remove_images(self, folder: Path) -> None:
        try:
            sessions = [read_session(file) for file in folder.glob("session*.json")]
            rooms = [room for one in sessions if one is not None for room in one.rooms]
            used = {name for room in rooms for name in names_of_images(room.textures)}
            remove_unused(folder, used | images_of_variants(folder))
        except (UserError, OSError) as error:
            self._screen.say(f"unused images of the store stay: {error}")
