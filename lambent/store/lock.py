"""A writer lock: a file lock that ends with its process, so that it cannot go stale."""

from __future__ import annotations

import errno
import os
import platform
import sys
import threading
from pathlib import Path
from weakref import WeakValueDictionary

from lambent.core.errors import UserError

FILE = ".writer.lock"  # the file stays in the folder; its existence means nothing
LONGEST = 300  # bytes of a process's number and its machine's name


def lock(handle: int, *, wait: bool) -> bool:
    """Lock an open file until it is closed; returns False if it is locked elsewhere and `wait` is False.

    On a drive without locks, such as some network drives, this does nothing and returns True.
    """
    try:
        if sys.platform == "win32":
            import msvcrt

            os.lseek(handle, 1 << 30, os.SEEK_SET)  # beyond the end: Windows blocks reads of locked bytes
            msvcrt.locking(handle, msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except OSError as error:
        return error.errno not in (errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK)
    return True


class WriterLock:
    """This process's exclusive right to write into `folder`, until `release` or deletion of the object.

    A second lock in the same thread takes over from the first, whose `held` turns False: the thread cannot be in the
    middle of a write. Another thread is refused like another process.

    Raises
    ------
    UserError
        If another process or thread is writing, or the folder is not writable.
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
            number, _, machine = os.read(self._handle, LONGEST).decode("utf-8", "replace").strip().partition(" ")
            elsewhere = machine and machine != platform.node()  # on a network drive
            who = f"process {number} on {machine}" if elsewhere else f"process {number}"
            self.release()
            hint = "wait until it ends, or stop it"
            raise UserError(
                "is locked by another writer", file=folder, got=who, expected="one writer at a time", hint=hint
            )
        try:
            os.ftruncate(self._handle, 0)
            os.write(self._handle, f"{self._process} {platform.node()}\n".encode())
        except OSError as error:
            self.release()
            raise UserError(f"cannot be written ({error.strerror})", file=folder) from error
        _held[path] = self

    @property
    def held(self) -> bool:
        """Whether this process may write; False in a forked child."""
        return self._handle is not None and self._process == os.getpid()

    def release(self) -> None:
        """Allow others to write."""
        handle, self._handle = self._handle, None
        if handle is not None:
            os.close(handle)

    __del__ = release


_held: WeakValueDictionary[Path, WriterLock] = WeakValueDictionary()
