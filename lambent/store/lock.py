"""One writer at a time: a lock on a file, which ends with the process that holds it, so that none can be stale."""

from __future__ import annotations

import errno
import os
import sys
import threading
from pathlib import Path
from weakref import WeakValueDictionary

from lambent.core.errors import UserError

FILE = ".writer.lock"  # stays in the folder; that it exists means nothing


def lock(handle: int, *, wait: bool) -> bool:
    """Lock an open file until it is closed; False where another open file has the lock and `wait` is False.

    A drive that knows no locks, as some network drives, goes without.
    """
    try:
        if sys.platform == "win32":
            import msvcrt

            os.lseek(handle, 1 << 30, os.SEEK_SET)  # past the end: others cannot read a locked byte
            msvcrt.locking(handle, msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except OSError as error:
        return error.errno not in (errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK)
    return True


class WriterLock:
    """The right of this process to write into `folder`, until `release` or the end of the object.

    A second lock in the same thread takes the right from the first, whose `held` turns False: a thread that asks is not
    in the middle of a write. Another thread is refused like another process.

    Raises
    ------
    UserError
        Where another process or thread writes, or the folder cannot be written.
    """

    def __init__(self, folder: Path) -> None:
        self._handle: int | None = None
        self._process, self._thread = os.getpid(), threading.current_thread()
        path = folder.resolve() / FILE
        older = _held.get(path)
        if older is not None and (older._thread is self._thread or not older._thread.is_alive()):
            older.release()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            raise UserError(f"cannot be written ({error.strerror})", file=folder) from error
        ours = lock(self._handle, wait=False)
        os.lseek(self._handle, 0, os.SEEK_SET)
        if not ours:
            who = f"process {os.read(self._handle, 20).decode('ascii', 'replace').strip()}"
            self.release()
            hint = "wait until it ends, or stop it"
            raise UserError(
                "is locked by another writer", file=folder, got=who, expected="one writer at a time", hint=hint
            )
        os.ftruncate(self._handle, 0)
        os.write(self._handle, f"{self._process}\n".encode("ascii"))
        _held[path] = self

    @property
    def held(self) -> bool:
        """Whether this process may write; a forked child may not."""
        return self._handle is not None and self._process == os.getpid()

    def release(self) -> None:
        """Let others write."""
        handle, self._handle = self._handle, None
        if handle is not None:
            os.close(handle)

    __del__ = release


_held: WeakValueDictionary[Path, WriterLock] = WeakValueDictionary()
