"""The session of a store, always current: written a moment after each change, and when the window closes.

The first window on a store owns its session. Another one is read-only: it shows the session, and can save materials as
documents. It takes over when the first has closed, if the file is still the one that it has read.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

from lambent.core.errors import UserError
from lambent.store.kept.images import names_of_images, readable, remove_unused
from lambent.store.kept.session import (
    FILE,
    FORMER_BACKUP,
    KeptView,
    SessionLock,
    WalkSession,
    read_session,
    write_session,
)
from lambent.store.kept.states import images_of_variants
from lambent.viewer.background.work import Work, pending
from lambent.viewer.edits.edits import MaterialEdits, unused
from lambent.viewer.screen import Screen

SOON_S = 1.5  # from the first change that is not written until it is; later changes do not put it off
ASK_S = 2.0  # interval of asking whether another window has closed
BACK = "unsaved changes of an earlier window are restored: undo takes them back"
READ_ONLY = "read-only: another window has this store open; here, only material documents can be saved"
CHANGED = "read-only: another window has changed the session; open the store again to go on from there"
TAKEN = "the other window has closed: this one keeps the session from now on"
NO_STORE = "there is no store to keep the session in"
PARTS = ("now", "beside", "states")  # of a session, without its view
FILES = (FILE, FORMER_BACKUP)


class SessionKeeper:
    """The session file of one store and its edits.

    Attributes
    ----------
    fault : str
        Reason why the session is not kept, in one line; else empty.
    view : callable
        The present view.
    """

    def __init__(self, edits: MaterialEdits, folder: Path | None, screen: Screen, soon_s: float = SOON_S) -> None:
        self._edits, self._folder, self._screen, self._soon_s = edits, folder, screen, soon_s
        self.fault = NO_STORE
        self.view: Callable[[], KeptView | None] = lambda: None
        self._opened = self._latest = WalkSession()
        self._written: WalkSession | None = None  # None: the file is not of this window's session
        self._foreign: dict[str, object] = {}  # materials of the present state that the store lacks
        self._aside = False  # whether the present file must be renamed before the first write
        self._lock: SessionLock | None = None
        self._stamp: object = None  # of the file, as read
        self._asked_s = 0.0
        self._work: Work | None = None
        self._hurry = threading.Event()

    def open(self, groups: Collection[str] = (), *, fresh: bool = False) -> tuple[str, ...]:
        """Open the session of the store; return lines on problems. `fresh` begins with the store as baked.

        `groups` are names of the store's light groups. A file that is not shown, because it is damaged or for
        `fresh`, is renamed at the first edit.
        """
        if self._folder is None:
            return ()
        self.fault = self._take_lock(self._folder)
        lines = [self.fault] if self.fault else []
        try:
            self._stamp = _stamp_of(self._folder / FILE)
            self._opened = read_session(self._folder / FILE) or WalkSession()
        except UserError as error:
            self._aside = True
            lines.append(f"the session cannot be read: {error}")
        if fresh:
            self._aside, self._opened = True, WalkSession()
        self._edits.begin_from(self._opened)
        self._written = self._opened
        if not self.fault and not fresh:
            lines += self._take_former_backup(self._folder / FORMER_BACKUP)
        session = self._edits.session
        self._foreign = {k: v for k, v in self._opened.now.materials.items() if k not in self._edits.scene}
        if unknown := sorted(
            {*self._opened.unknown(self._edits.scene, groups), *session.unknown(self._edits.scene, groups)}
        ):
            lines.append(f"the session has {', '.join(unknown)}, which the store lacks: kept, not shown")
        faults = (readable(room.textures, self._folder)[1] for room in session.rooms)
        lines += dict.fromkeys(fault for of_room in faults for fault in of_room)
        return tuple(lines)

    @property
    def opened_view(self) -> KeptView | None:
        """The view of the opened session."""
        return self._opened.view

    def _take_lock(self, folder: Path) -> str:
        """Make this window the owner of the session; return the reason of a failure, else an empty text."""
        try:
            self._lock = SessionLock(folder)
        except UserError as error:
            return f"read-only: the session cannot be kept: {error}"
        return "" if self._lock.held else READ_ONLY

    def _take_former_backup(self, file: Path) -> list[str]:
        """Take the unsaved changes that a window of version 1 left; the file goes with the next write."""
        try:
            unsaved = read_session(file)
        except UserError as error:
            kept = _moved_aside(file)
            return [f"unsaved changes of an earlier window cannot be read ({error}); the file is now {kept.name}"]
        if unsaved is None:
            return []
        self._edits.go_to(unsaved)
        self._written = None
        return [BACK] if self._edits.can_undo else []

    @property
    def session(self) -> WalkSession:
        """The session as it is now."""
        session = self._edits.session.model_copy(update={"view": self.view() or self._opened.view})
        if not self._foreign:
            return session
        now = session.now.model_copy(update={"materials": {**self._foreign, **session.now.materials}})
        return session.model_copy(update={"now": now})

    @property
    def unsaved(self) -> tuple[str, ...]:
        """Names of edits that are lost with this window, for people; materials by name."""
        if not self.fault:
            return ()
        edits, kept = self._edits, self._kept
        names = [name for name in edits.scene if not self._is_saved(name)]
        now, textures = edits.room.textures, kept.now.only(edits.scene).textures
        more = [
            *((f"the texture of {name}", now.get(name) != textures.get(name)) for name in edits.scene),
            ("the lamps", edits.room.lamps != kept.now.lamps),
            ("the light mix", edits.light != kept.now.light),
            ("stored states", edits.stored != kept.states),
            ("the state to compare with", edits.other != kept.beside),
        ]
        return (*names, *(what for what, changed in more if changed))

    @property
    def _kept(self) -> WalkSession:
        """The session on disk."""
        return self._written or self._opened

    @property
    def has_lock(self) -> bool:
        """Whether this window may write the session and keep images beside it."""
        return self._lock is not None and self._lock.held

    def _is_saved(self, name: str) -> bool:
        """Whether a material equals that of the session on disk, or its last saved document."""
        now = self._edits.current(name)
        return now in (self._kept.now.materials.get(name, self._edits.scene[name]), self._edits.saved.get(name))

    def tick(self) -> None:
        """Take the end of a write, and begin one if anything has changed."""
        self._work = pending(self._work)
        if self.fault == READ_ONLY:
            self._ask()
        if not self.has_lock:
            return
        self._latest = self.session
        if self._work is None and self._is_due:
            self._hurry.clear()
            self._work = Work(lambda _: self._write_soon(), self._done, self._failed, self._screen.wake)

    @property
    def _is_due(self) -> bool:
        """Whether the file is not current. One that is to be renamed stays until an edit replaces it."""
        if self._latest == self._written:
            return False
        return not self._aside or any(getattr(self._latest, part) != getattr(self._opened, part) for part in PARTS)

    def _ask(self) -> None:
        """Take over from a window that has closed, if it has left the file as this one read it."""
        if self._folder is None or self._screen.clock() - self._asked_s < ASK_S:
            return
        self._asked_s = self._screen.clock()
        if self._take_lock(self._folder):
            return
        if _stamp_of(self._folder / FILE) == self._stamp:
            self.fault = ""
            self._screen.say(TAKEN)
        else:
            self.fault = CHANGED
            self._release()

    def wait_s(self) -> float | None:
        """Seconds until `tick` has something to do although nothing happens; None: never."""
        return max(0.0, self._asked_s + ASK_S - self._screen.clock()) if self.fault == READ_ONLY else None

    def _write_soon(self) -> str:
        self._hurry.wait(self._soon_s)
        return self._write(self._latest)

    def _write(self, session: WalkSession) -> str:
        """Write a session; return a line on a renamed file, if any. Raises `UserError` on failure."""
        folder, line = self._folder, ""
        if folder is None or not folder.is_dir():
            raise UserError("store was deleted or moved", file=folder)
        try:
            if self._aside:
                moved = [_moved_aside(folder / name).name for name in FILES if (folder / name).exists()]
                line, self._aside = f"the earlier session is now {', '.join(moved)}" if moved else "", False
            write_session(folder / FILE, session)
            (folder / FORMER_BACKUP).unlink(missing_ok=True)
        except OSError as error:
            raise UserError(f"cannot be written ({error.strerror})", file=folder / FILE) from error
        self._written = session
        return line

    def _done(self, line: str) -> None:
        self.fault = ""
        if line:
            self._screen.say(line)

    def _failed(self, error: UserError) -> None:
        fault = f"the session is not kept: {error}"
        if fault != self.fault:
            self._screen.say(fault)
        self.fault = fault

    def save(self) -> bool:
        """Write the session at once; return whether the file is current."""
        self._edits.end_stroke()
        self._finish()
        if self.has_lock:
            self._latest = self.session
            try:
                self._done(self._write(self._latest) if self._is_due else "")
            except UserError as error:
                self._failed(error)
        self._screen.say(self.fault or "the session is saved in the store")
        return not self.fault

    def rescue(self) -> Iterator[str]:
        """Write the session of a lost window; yield its place as text. May raise `UserError`."""
        self._finish()
        self._latest = self.session
        if self._is_due:
            self._write(self._latest)
            yield f"{self._folder}; the next window on the store shows it"

    @property
    def keeps(self) -> bool:
        """Whether changes are kept in the store."""
        return self.has_lock and not self.fault and self._folder is not None and self._folder.is_dir()

    def close(self) -> None:
        """Write the session, release it to another window, and delete images that no session uses."""
        if self.keeps and self.save() and self._folder is not None:
            self._remove_images(self._folder)
        self._finish()
        self._release()

    def _remove_images(self, folder: Path) -> None:
        try:
            sessions = [read_session(file) for file in folder.glob("session*.json")]
            rooms = [room for one in sessions if one is not None for room in one.rooms]
            used = {name for room in rooms for name in names_of_images(room.textures)}
            remove_unused(folder, used | images_of_variants(folder))
        except (UserError, OSError) as error:
            self._screen.say(f"unused images of the store stay: {error}")

    def _finish(self) -> None:
        """Wait until what is to be written is."""
        if self._work is not None:
            self._hurry.set()
            self._work.wait()
            self._work = pending(self._work)

    def _release(self) -> None:
        if self._lock is not None:
            self._lock.release()


def _stamp_of(file: Path) -> object:
    """A value that changes when a file is replaced; None without one."""
    if not file.exists():
        return None
    found = file.stat()
    return found.st_ino, found.st_mtime_ns, found.st_size


def _moved_aside(file: Path) -> Path:
    """Rename a file that is not shown to a free name."""
    kept = file.with_name(f"{unused(file.parent, f'{file.stem}-kept', '.json')}.json")
    file.rename(kept)
    return kept
