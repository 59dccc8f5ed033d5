"""The session file of a store, always current: written a moment after each change, and when the window closes.

The first window on a store owns its session. Another one is read-only: it shows the session, and can save materials as
documents. It takes over when the first has closed, if the file is still the one that it has read.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

from lambent.core.errors import UserError
from lambent.store.kept.session import FILE, FORMER_BACKUP, SessionLock, WalkSession, read_session, write_session
from lambent.viewer.background.work import Work, pending
from lambent.viewer.edits.edits import unused
from lambent.viewer.screen import Screen

SOON_S = 1.5  # from the first change that is not written until it is; later changes do not put it off
ASK_S = 2.0  # interval of asking whether another window has closed
READ_ONLY = (
    "read-only: another window has this store open; edits in this one are not kept, materials can be saved as documents"
)
CHANGED = "read-only: another window has changed the session; open the store again to go on from there"
TAKEN = "the other window has closed: this one keeps the session from now on"
NO_STORE = "there is no store to keep the session in"
PARTS = ("now", "beside", "states", "edited", "sky")  # of a session, without its view
FILES = (FILE, FORMER_BACKUP)


class SessionFile:
    """Keeps the `session` of a window, which a subclass defines.

    Attributes
    ----------
    fault : str
        Reason why the session is not kept, in one line; else empty.
    """

    def __init__(self, folder: Path | None, screen: Screen, soon_s: float = SOON_S) -> None:
        self._folder, self._screen, self._soon_s = folder, screen, soon_s
        self.fault = NO_STORE
        self.opened = WalkSession()  # as read
        self._latest = self.opened
        self._written: WalkSession | None = None  # None: the file is not of this window's session
        self._aside = False  # whether the present file must be renamed before the first write
        self._lock: SessionLock | None = None
        self._stamp: object = None  # of the file, as read
        self._spent: Path | None = None  # a former backup that the session has taken
        self._asked_s = 0.0
        self._work: Work | None = None
        self._hurry = threading.Event()

    @property
    def session(self) -> WalkSession:
        """The session as it is now."""
        raise NotImplementedError

    def read(self, folder: Path, *, fresh: bool = False) -> list[str]:
        """Read the session of a store; return lines on problems. `fresh` begins with the store as baked.

        A file that is not shown, because it is damaged or for `fresh`, is renamed at the first edit.
        """
        self.fault = self._take_lock(folder)
        lines = [self.fault] if self.fault else []
        try:
            self._stamp = _stamp_of(folder / FILE)
            self.opened = read_session(folder / FILE) or WalkSession()
        except UserError as error:
            self._aside = True
            lines.append(f"the session cannot be read: {error}")
        if fresh:
            self._aside, self.opened = True, WalkSession()
        self._written = self.opened
        return lines

    def _take_lock(self, folder: Path) -> str:
        """Make this window the owner of the session; return the reason of a failure, else an empty text."""
        try:
            self._lock = SessionLock(folder)
        except UserError as error:
            return f"read-only: the session cannot be kept: {error}"
        return "" if self._lock.held else READ_ONLY

    @property
    def has_lock(self) -> bool:
        """Whether this window may write the session and keep images beside it."""
        return self._lock is not None and self._lock.held

    @property
    def keeps(self) -> bool:
        """Whether changes are kept in the store."""
        return self.has_lock and not self.fault and self._folder is not None and self._folder.is_dir()

    @property
    def kept(self) -> WalkSession:
        """The session on disk."""
        return self._written or self.opened

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
        elif self._latest == self._written:
            self.fault = ""  # of a change that was undone

    @property
    def _is_due(self) -> bool:
        """Whether the file is not current. One that is to be renamed stays until an edit replaces it."""
        if self._latest == self._written:
            return False
        changed = any(getattr(self._latest, part) != getattr(self.opened, part) for part in PARTS)
        return changed or not self._aside or self._screen.exchanging  # the next mode goes on from the file

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
                renamed = [moved_aside(folder / name).name for name in FILES if (folder / name).exists()]
                line, self._aside = f"the earlier session is now {', '.join(renamed)}" if renamed else "", False
            write_session(folder / FILE, session)
            if self._spent is not None:
                self._spent.unlink(missing_ok=True)
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
        """Write the session at once, and say so; return whether the file is current."""
        self._write_now()
        self._screen.say(self.fault or "the session is saved in the store")
        return not self.fault

    def _write_now(self) -> None:
        self._finish()
        if self.has_lock:
            self._latest = self.session
            try:
                self._done(self._write(self._latest) if self._is_due else "")
            except UserError as error:
                self._failed(error)

    def rescue(self) -> Iterator[str]:
        """Write the session of a lost window; yield its place as text. May raise `UserError`."""
        self._finish()
        self._latest = self.session
        if self._is_due:
            self._write(self._latest)
            yield f"{self._folder}; the next window on the store shows it"

    def close(self) -> None:
        """Write the session, and release it to another window."""
        self._write_now()
        self._release()

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


def moved_aside(file: Path) -> Path:
    """Rename a file that is not shown to a free name."""
    kept = file.with_name(f"{unused(file.parent, f'{file.stem}-kept', '.json')}.json")
    file.rename(kept)
    return kept
