"""File safety: whole files or none, hashes, names that stay inside their folder."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lambent.core.errors import UserError


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Path to write beside `path`; on leaving without an error it is flushed to disk and renamed into place.

    A reader sees the old file or the new one, never a part; a crash leaves the old one.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}.", suffix=path.suffix)
    os.close(handle)
    beside = Path(name)
    try:
        yield beside
        with beside.open("rb+") as file:
            os.fsync(file.fileno())
        os.chmod(beside, 0o644)
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)


def check_place(path: Path) -> None:
    """`UserError` where no file can be written at `path`, before long work begins. Leaves nothing behind."""
    path = Path(path)
    if path.is_dir():
        raise UserError("is a folder", file=path, expected="a name for a file")
    folder = next((p for p in path.absolute().parents if p.exists()), path.parent)
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise UserError(f"cannot be written ({error.strerror})", file=path) from error


def write_text(path: Path, text: str) -> None:
    """Write `text` as UTF-8, atomically; what UTF-8 cannot hold, from names of files, is written as an escape."""
    with atomic_path(path) as beside:
        beside.write_text(text, encoding="utf-8", errors="backslashreplace")


def sha256_of(path: Path) -> str:
    """SHA-256 of a file's content, as hex."""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def read_bytes(path: Path, limit_bytes: int) -> bytes:
    """Content of a user's file, or a `UserError` where it is missing, a folder, unreadable or over `limit_bytes`."""
    path = Path(path)
    try:
        size = path.stat().st_size
        if size > limit_bytes:
            raise UserError("file is too large", file=path, got=f"{size} bytes", expected=f"at most {limit_bytes}")
        return path.read_bytes()
    except OSError as error:
        raise UserError(f"cannot be read ({error.strerror})", file=path) from error


def inside(folder: Path, name: str) -> Path:
    """`folder / name` as a real path, or a `UserError` where the name would leave the folder."""
    folder = Path(folder).resolve()
    if "\0" in name:
        raise UserError("is not a file name", file=folder, got=name)
    path = (folder / name).resolve()
    if not path.is_relative_to(folder):
        raise UserError("path leaves its folder", file=folder, got=name, expected="a path below it")
    return path
