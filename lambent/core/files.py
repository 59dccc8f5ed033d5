"""File safety: atomic writes, regular files only, and names that stay inside their folder."""

from __future__ import annotations

import hashlib
import os
import platform
import re
import secrets
import stat
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from lambent.core.errors import UserError

# Part of temporary file names: the machine, the process and its run (a later process may reuse a dead one's number).
_MACHINE = f".lambent-{hashlib.sha256(platform.node().encode()).hexdigest()[:8]}-"
_RUN = secrets.token_hex(4)
_BESIDE = re.compile(re.escape(_MACHINE) + r"(\d+)-([0-9a-f]{8})-")
_STALE_S = 86400.0  # fallback where liveness of a process cannot be queried: no write takes this long
_numbers = count()
_cleared: set[Path] = set()


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Temporary path beside `path`; a clean exit of the block flushes it to disk and renames it into place.

    A reader sees the old file or the new one, never a part; a crash leaves the old one. A missing folder is created. A
    symbolic link stays and its target is replaced. A new file gets its mode from the umask; a replaced file keeps its
    mode. Temporary files of killed processes are removed.

    Raises
    ------
    UserError
        If `path` is a folder, a device or a pipe, or the disk is full, read-only or fails. It names `path`.
    """
    target = real_file(path)
    beside = target.with_name(f"{_MACHINE}{os.getpid()}-{_RUN}-{next(_numbers)}{target.suffix}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        os.close(os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
    except OSError as error:
        raise _unwritable(path, error) from error
    if target.parent not in _cleared:
        _cleared.add(target.parent)
        remove_left_over(target.parent)
    try:
        yield beside
        with beside.open("rb+") as file:
            os.fsync(file.fileno())
        with suppress(FileNotFoundError):
            os.chmod(beside, stat.S_IMODE(target.stat().st_mode) & 0o777)
        os.replace(beside, target)
    except OSError as error:
        if error.filename is not None and str(error.filename) != str(beside):
            raise  # raised for another file
        raise _unwritable(path, error) from error
    finally:
        with suppress(OSError):
            beside.unlink(missing_ok=True)


def real_file(path: Path) -> Path:
    """Resolve the links of `path`; `UserError` if the target exists but is not a regular file.

    No caller may replace a device, a pipe or a socket by a file.
    """
    target = Path(os.path.realpath(path))
    try:
        mode = target.stat().st_mode
    except FileNotFoundError:
        return target
    except OSError as error:
        raise _unwritable(path, error) from error
    if stat.S_ISDIR(mode):
        raise UserError("is a folder", file=path, expected="a file name")
    if not stat.S_ISREG(mode):
        raise UserError("is a device or a pipe", file=path, expected="a file name")
    return target


def check_place(path: Path) -> None:
    """Raise `UserError` if no file can be written at `path`; called before long work, leaves nothing behind."""
    target = real_file(path)
    folder = next((p for p in target.parents if p.exists()), target.parent)
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
        target.with_name(f"{_MACHINE}{target.suffix}").exists()  # fails if the suffix makes the name too long
    except OSError as error:
        raise _unwritable(path, error) from error
    if target.exists() and not os.access(target, os.W_OK):
        raise UserError("is read-only", file=path, hint="write to another file")


def remove_left_over(folder: Path) -> None:
    """Remove temporary files in `folder` of killed processes of this machine."""
    with suppress(OSError):  # leftovers must not stop the caller
        for path in Path(folder).iterdir():
            found = _BESIDE.match(path.name)
            if found is not None and not _is_alive(int(found[1]), found[2], path):
                path.unlink(missing_ok=True)


def _is_alive(process: int, run: str, path: Path) -> bool:
    """Whether the process that wrote temporary file `path` still runs."""
    if process == os.getpid():
        return run == _RUN
    if sys.platform == "win32":  # where querying a process can end it
        return time.time() - path.stat().st_mtime < _STALE_S
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        pass
    return True


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Context whose faults of the disk name `path`: a write that fails does not say of which file."""
    try:
        yield
    except OSError as error:
        raise _unwritable(path, error) from error


def _unwritable(path: Path, error: OSError) -> UserError:
    return UserError(f"cannot be written ({error.strerror or error})", file=path)


def place_from(folder: Path, path: Path) -> str:
    """A path as seen from a folder, with forward slashes; absolute on another drive of Windows."""
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:
        return str(path.resolve())


def write_bytes(path: Path, content: bytes) -> None:
    """Write `content`, atomically."""
    with atomic_path(path) as beside:
        beside.write_bytes(content)


def write_text(path: Path, text: str) -> None:
    """Write `text` as UTF-8, atomically; surrogates, as in file names, are escaped."""
    with atomic_path(path) as beside:
        beside.write_text(text, encoding="utf-8", errors="backslashreplace")


def inside(folder: Path, name: str) -> Path:
    """`folder / name` as a real path; `UserError` if it lies outside the folder."""
    folder = Path(folder).resolve()
    try:
        path = (folder / name).resolve()
        path.is_file()  # raises if the name is too long
    except (ValueError, OSError, RuntimeError) as error:  # null characters, lone surrogates, circular links
        raise UserError("is not a file name", file=folder, got=ascii(name)) from error
    if not path.is_relative_to(folder):
        raise UserError("path leaves its folder", file=folder, got=name, expected="a path below it")
    return path


def folder_bytes(folder: Path) -> int:
    """Total size of all files below a folder."""
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
