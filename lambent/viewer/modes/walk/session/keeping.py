"""The session of a store: opens and saves it, and backs up unsaved changes beside it.

The first window on a store owns its session; another window shows it and can only save materials as documents.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from lambent.core.errors import UserError
from lambent.store.kept.images import names_of_images, readable, remove_unused
from lambent.store.kept.session import FILE, UNSAVED_FILE, SessionLock, WalkSession, read_session, write_session
from lambent.store.kept.states import images_of_variants
from lambent.viewer.background.work import Work, pending
from lambent.viewer.edits.edits import MaterialEdits, unused
from lambent.viewer.screen import Screen

QUIET_S = 1.5  # time without a change before unsaved changes are backed up
BACK = "unsaved changes of the last window are restored: save them, or undo"
ELSEWHERE = "another window has the session of this store open: here, only material documents can be saved"
NO_STORE = "there is no store to save the session in"


class SessionKeeper:
    """The session file of one store and its edits.

    Attributes
    ----------
    fault : str
        Reason why the session cannot be saved, in one line; else empty.
    """

    def __init__(self, edits: MaterialEdits, folder: Path | None, screen: Screen) -> None:
        self._edits, self._folder, self._screen = edits, folder, screen
        self.fault = NO_STORE
        self._kept = WalkSession()  # as saved
        self._foreign: dict[str, object] = {}  # materials of the present state that the store lacks
        self._set_aside = False  # whether the unreadable session file must be renamed before saving
        self._lock: SessionLock | None = None
        self._seen = edits.session
        self._due_s: float | None = None
        self._is_written = False  # whether the backup file exists
        self._work: Work | None = None

    def open(self, groups: Collection[str] = ()) -> tuple[str, ...]:
        """Open the session of the store with the backup of unsaved changes; return lines on problems.

        `groups` are names of the store's light groups.
        """
        if self._folder is None:
            return ()
        self.fault = self._take_lock(self._folder)
        lines = [self.fault] if self.fault else []
        try:
            self._kept = read_session(self._folder / FILE) or WalkSession()
        except UserError as error:
            self._set_aside = True
            lines.append(f"the session cannot be read: {error}")
        self._edits.begin_from(self._kept)
        if not self.fault:
            lines += self._take_unsaved(self._folder / UNSAVED_FILE)
        session = self._edits.session
        self._foreign = {k: v for k, v in self._kept.now.materials.items() if k not in self._edits.scene}
        if unknown := sorted(
            {*self._kept.unknown(self._edits.scene, groups), *session.unknown(self._edits.scene, groups)}
        ):
            lines.append(f"the session has {', '.join(unknown)}, which the store lacks: kept, not shown")
        faults = (readable(room.textures, self._folder)[1] for room in session.rooms)
        lines += dict.fromkeys(fault for of_room in faults for fault in of_room)
        self._seen = session
        return tuple(lines)

    def _take_lock(self, folder: Path) -> str:
        """Make this window the owner of the session; return the reason of a failure, else an empty text."""
        try:
            self._lock = SessionLock(folder)
        except UserError as error:
            return f"the session cannot be saved: {error}"
        return "" if self._lock.held else ELSEWHERE

    def _take_unsaved(self, file: Path) -> list[str]:
        try:
            unsaved = read_session(file)
        except UserError as error:
            kept = _moved_aside(file)
            return [f"unsaved changes of the last window cannot be read ({error}); the file was renamed to {kept.name}"]
        if unsaved is None:
            return []
        self._is_written = True
        self._edits.go_to(unsaved)
        return [BACK] if self.unsaved else []

    @property
    def session(self) -> WalkSession:
        """The session to save."""
        session = self._edits.session
        if not self._foreign:
            return session
        now = session.now.model_copy(update={"materials": {**self._foreign, **session.now.materials}})
        return session.model_copy(update={"now": now})

    @property
    def unsaved(self) -> tuple[str, ...]:
        """Names of unsaved parts of the session, for people; materials by name."""
        edits, kept = self._edits, self._kept
        names = [name for name in edits.scene if not self._is_saved(name)]
        more = [
            *((f"the texture of {name}", True) for name in self._unsaved_textures),
            ("the lamps", edits.room.lamps != kept.now.lamps),
            ("the light mix", edits.light != kept.now.light),
            ("stored states", edits.stored != kept.states),
            ("the state to compare with", edits.other != kept.beside),
        ]
        return (*names, *(what for what, changed in more if changed))

    @property
    def _unsaved_textures(self) -> list[str]:
        """Materials whose textures differ from those of the saved session."""
        now, kept = self._edits.room.textures, self._kept.now.only(self._edits.scene).textures
        return [name for name in self._edits.scene if now.get(name) != kept.get(name)]

    @property
    def has_lock(self) -> bool:
        """Whether this window may write the session and keep images beside it."""
        return self._lock is not None and self._lock.held

    def _is_saved(self, name: str) -> bool:
        """Whether a material equals that of the saved session, or its last saved document."""
        now = self._edits.current(name)
        return now in (self._kept.now.materials.get(name, self._edits.scene[name]), self._edits.saved.get(name))

    def save(self) -> bool:
        """Write the session into the store; return whether it was saved."""
        if self.fault or self._folder is None:
            self._screen.say(f"session not saved: {self.fault}")
            return False
        self._edits.end_stroke()
        self._finish()
        try:
            if not self._folder.is_dir():
                raise UserError("store was deleted or moved", file=self._folder)
            if self._set_aside:
                self._screen.say(f"the unreadable session was renamed to {_moved_aside(self._folder / FILE).name}")
                self._set_aside = False
            write_session(self._folder / FILE, self.session)
        except (UserError, OSError) as error:
            self._screen.say(f"session not saved: {error}")
            return False
        self._kept = self.session
        self._remove()
        self._screen.say("saved the session in the store")
        return True

    def tick(self) -> None:
        """Back up unsaved changes, a while after the last change."""
        self._work = pending(self._work)
        if self.fault or self._folder is None:
            return
        now_s, session = self._screen.clock(), self._edits.session
        if session != self._seen:
            self._seen, self._due_s = session, now_s + QUIET_S
        if self._due_s is None or now_s < self._due_s or self._edits.in_stroke or self._work is not None:
            return
        self._due_s = None
        if not self.unsaved:
            self._remove()
        elif self._folder.is_dir():
            file, written = self._folder / UNSAVED_FILE, self.session
            self._is_written = True
            self._work = Work(lambda progress: write_session(file, written), lambda _: None, self._failed)

    def wait_s(self) -> float | None:
        """Seconds until `tick` has something to do."""
        return None if self._due_s is None else max(0.0, self._due_s - self._screen.clock())

    def rescue(self) -> Iterator[str]:
        """Back up unsaved changes of a lost window; yield the backup's place as text. May raise `UserError`."""
        self._finish()
        if not self.unsaved or self.fault or self._folder is None or not self._folder.is_dir():
            return
        write_session(self._folder / UNSAVED_FILE, self.session)
        yield f"{self._folder / UNSAVED_FILE}; the next window on the store restores it"

    @property
    def keeps(self) -> bool:
        """Whether unsaved changes of a lost window are backed up in the store."""
        return not self.fault and self._folder is not None and self._folder.is_dir()

    def discard(self) -> None:
        """Discard unsaved changes and their backup."""
        self._finish()
        self._due_s = None
        self._remove()

    def close(self) -> None:
        """Release the session to another window, and delete images that no saved state uses."""
        self._finish()
        if self._folder is not None and self.has_lock and not self._set_aside:
            self._remove_images(self._folder)
        self._release()

    def _remove_images(self, folder: Path) -> None:
        try:
            sessions = [read_session(folder / file) for file in (FILE, UNSAVED_FILE)]
            rooms = [room for one in sessions if one is not None for room in one.rooms]
            used = {name for room in rooms for name in names_of_images(room.textures)}
            remove_unused(folder, used | images_of_variants(folder))
        except (UserError, OSError) as error:
            self._screen.say(f"unused images of the store stay: {error}")

    def _finish(self) -> None:
        if self._work is not None:
            self._work.wait()
            self._work = pending(self._work)

    def _remove(self) -> None:
        if self._is_written and self._folder is not None:
            (self._folder / UNSAVED_FILE).unlink(missing_ok=True)
            self._is_written = False

    def _release(self) -> None:
        if self._lock is not None:
            self._lock.release()

    def _failed(self, error: UserError) -> None:
        self._screen.say(f"unsaved changes could not be backed up: {error}")


def _moved_aside(file: Path) -> Path:
    """Rename an unreadable file to a free name."""
    kept = file.with_name(f"{unused(file.parent, f'{file.stem}-kept', '.json')}.json")
    file.rename(kept)
    return kept
