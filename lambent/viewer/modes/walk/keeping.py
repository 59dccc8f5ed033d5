"""Keeps the session of a store: opened with it, saved into it, and what is unsaved written beside it meanwhile.

The first window on a store keeps its session; another one shows it, and saves materials as documents alone.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from lambent.core.errors import UserError
from lambent.store.session import FILE, UNSAVED_FILE, SessionLock, WalkSession, read_session, write_session
from lambent.viewer.edits import MaterialEdits, unused
from lambent.viewer.screen import Screen
from lambent.viewer.work import Work, pending

QUIET_S = 1.5  # without a change, before what is unsaved is written
BACK = "unsaved changes of the last window are back: save them, or undo"
ELSEWHERE = "another window keeps the session of this store: changes made here are saved as documents alone"
NO_STORE = "there is no store to save the session with"


class SessionKeeper:
    """The session file of one store, and the edits that it holds.

    Attributes
    ----------
    fault : str
        Why the session cannot be saved, in a line; empty where it can be.
    """

    def __init__(self, edits: MaterialEdits, folder: Path | None, screen: Screen) -> None:
        self._edits, self._folder, self._screen = edits, folder, screen
        self.fault = NO_STORE
        self._kept = WalkSession()  # as it is saved
        self._foreign: dict[str, object] = {}  # materials of the present state that the store does not have
        self._set_aside = False  # the file that is there cannot be read, and is kept under another name
        self._lock: SessionLock | None = None
        self._seen = edits.session
        self._due_s: float | None = None
        self._is_written = False  # the file of what is unsaved is there
        self._work: Work | None = None

    def open(self, groups: Collection[str] = ()) -> tuple[str, ...]:
        """Take the session of the store, with what was not saved the last time; lines on what is amiss.

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
            lines.append(f"the session is left aside: {error}")
        self._edits.begin_from(self._kept)
        if not self.fault:
            lines += self._take_unsaved(self._folder / UNSAVED_FILE)
        session = self._edits.session
        self._foreign = {k: v for k, v in self._kept.now.materials.items() if k not in self._edits.scene}
        if unknown := sorted(
            {*self._kept.unknown(self._edits.scene, groups), *session.unknown(self._edits.scene, groups)}
        ):
            lines.append(f"the session names {', '.join(unknown)}, which the store does not have: kept, not shown")
        self._seen = session
        return tuple(lines)

    def _take_lock(self, folder: Path) -> str:
        """Make this window the one that keeps the session; why that cannot be, in a line."""
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
            return [f"unsaved changes of the last window cannot be read ({error}); the file is now {kept.name}"]
        if unsaved is None:
            return []
        self._is_written = True
        self._edits.go_to(unsaved)
        return [BACK] if self.unsaved else []

    @property
    def session(self) -> WalkSession:
        """What would be saved now."""
        session = self._edits.session
        if not self._foreign:
            return session
        now = session.now.model_copy(update={"materials": {**self._foreign, **session.now.materials}})
        return session.model_copy(update={"now": now})

    @property
    def unsaved(self) -> tuple[str, ...]:
        """What of the present session is not as it is saved, in plain words; materials by their names."""
        edits, kept = self._edits, self._kept
        names = [name for name in edits.scene if not self._is_saved(name)]
        more = [
            ("textures", edits.room.textures != kept.now.only(edits.scene).textures),
            ("the mix of light", edits.light != kept.now.light),
            ("stored states", edits.stored != kept.states),
            ("the state to compare with", edits.other != kept.beside),
        ]
        return (*names, *(what for what, changed in more if changed))

    def _is_saved(self, name: str) -> bool:
        """Whether a material is as the session has it, or as its document was saved last."""
        now = self._edits.current(name)
        return now in (self._kept.now.materials.get(name, self._edits.scene[name]), self._edits.saved.get(name))

    def save(self) -> bool:
        """Write the session into the store; whether that was possible."""
        if self.fault or self._folder is None:
            self._screen.say(f"session not saved: {self.fault}")
            return False
        self._edits.end_stroke()
        self._finish()
        try:
            if not self._folder.is_dir():
                raise UserError("the store is gone", file=self._folder)
            if self._set_aside:
                self._screen.say(f"the session that could not be read is now {_moved_aside(self._folder / FILE).name}")
                self._set_aside = False
            write_session(self._folder / FILE, self.session)
        except (UserError, OSError) as error:
            self._screen.say(f"session not saved: {error}")
            return False
        self._kept = self.session
        self._remove()
        self._screen.say("saved the session with the store")
        return True

    def tick(self) -> None:
        """Write what is unsaved, a while after the last change."""
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
        """The window is lost: write what is unsaved; where, for people. `UserError` where that cannot be."""
        self._finish()
        if not self.unsaved or self.fault or self._folder is None or not self._folder.is_dir():
            return
        write_session(self._folder / UNSAVED_FILE, self.session)
        yield f"{self._folder / UNSAVED_FILE}, which the next window on the store brings back"

    @property
    def keeps(self) -> bool:
        """Whether a lost window leaves what is unsaved with the store."""
        return not self.fault and self._folder is not None and self._folder.is_dir()

    def discard(self) -> None:
        """Keep nothing of what is unsaved."""
        self._finish()
        self._due_s = None
        self._remove()

    def close(self) -> None:
        """Let another window keep the session."""
        self._finish()
        self._release()

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
        self._screen.say(f"unsaved changes could not be kept: {error}")


def _moved_aside(file: Path) -> Path:
    """Give a file that cannot be read a free name beside its own."""
    kept = file.with_name(f"{unused(file.parent, f'{file.stem}-kept', '.json')}.json")
    file.rename(kept)
    return kept
