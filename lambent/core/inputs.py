"""Input: every file of a user is opened here, read no further than its ceiling, and its JSON parsed."""

from __future__ import annotations

import hashlib
import json
import os
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from io import BufferedReader
from pathlib import Path
from typing import Any

from lambent.core.errors import UserError

UNREADABLE = "cannot be read as"
_LONGEST_FAULT = 120


@contextmanager
def open_input(path: Path) -> Iterator[BufferedReader]:
    """Open a user's file for reading; raise `UserError` if it is missing, unreadable or not a regular file.

    All user files must go through here: a pipe would block for ever, a device may never end, and opening a device may
    have side effects.
    """
    path = Path(path)
    try:
        _check_regular(path.stat().st_mode, path)
        flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        handle = os.open(path, flags)
    except ValueError as error:  # a null character or a lone surrogate in the name
        raise UserError("is not a file name", file=ascii(str(path))) from error
    except OSError as error:
        raise UserError(f"cannot be read ({error.strerror})", file=path) from error
    try:
        with open(handle, "rb") as file:
            _check_regular(os.fstat(handle).st_mode, path)  # the name may refer to another file by now
            yield file
    except OSError as error:
        raise UserError(f"cannot be read ({error.strerror})", file=path) from error


def _check_regular(mode: int, path: Path) -> None:
    if stat.S_ISREG(mode):
        return
    kinds = {stat.S_IFDIR: "a folder", stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket"}
    found = kinds.get(stat.S_IFMT(mode), "a device")
    hint = "write its content to a file first" if found == "a pipe" else None
    raise UserError("cannot be read", file=path, got=found, expected="a file", hint=hint)


@contextmanager
def foreign_bytes(reader: str, path: Path) -> Iterator[None]:
    """Turn any exception of a reader into a `UserError` with the reader's name.

    Readers reject known faults themselves; this catches the rest.
    """
    try:
        yield
    except UserError:
        raise
    except Exception as error:
        said = " ".join(str(error).split())
        fault = type(error).__name__ + (f": {said[:_LONGEST_FAULT]}" if said else "")
        raise UserError(f"{UNREADABLE} {reader} ({fault})", file=path) from error


def sha256_of(path: Path) -> str:
    """SHA-256 of a user's file, as hex digits."""
    with open_input(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


BUILTIN_PREFIX = "builtin:"  # of names of scenes that come with the package


def read_head(path: Path, size: int) -> bytes:
    """The first bytes of a user's file, at most `size`."""
    with open_input(path) as file:
        return file.read(size)


def read_bytes(path: Path, limit_bytes: int) -> bytes:
    """Content of a user's file; raise `UserError` if `open_input` rejects it or it exceeds `limit_bytes`."""
    with open_input(path) as file:
        size = os.fstat(file.fileno()).st_size
        parts, read = [], 0
        # The reported size is a hint: files of /proc report 0, and other files grow while they are read.
        while size <= limit_bytes and (part := file.read(max(size - read, 1 << 16))):
            parts.append(part)
            read += len(part)
            size = max(size, read)
    if size > limit_bytes:
        raise UserError("file is too large", file=path, got=f"{size} bytes", expected=f"at most {limit_bytes}")
    return parts[0] if len(parts) == 1 else b"".join(parts)


def decoded(text: bytes) -> str:
    """Text of a format that does not name its encoding: UTF-8, else Latin-1, as older programs write names."""
    try:
        return text.decode("utf-8-sig")
    except UnicodeDecodeError:
        return text.decode("latin-1")


_HALF_CHARACTER = re.compile(rb"\\u[dD][89a-fA-F]")


def parse_json(text: bytes, file: Path) -> Any:
    """The value of a JSON text; raise `UserError` if it is invalid or has strings that UTF-8 cannot encode."""
    try:
        value = json.loads(text.decode("utf-8-sig"))
        if _HALF_CHARACTER.search(text):
            json.dumps(value, ensure_ascii=False).encode("utf-8")
    except UnicodeEncodeError as error:
        half = error.object[error.start : error.end]
        raise UserError("text has an unpaired surrogate", file=file, got=ascii(half)[:20]) from error
    except (ValueError, RecursionError) as error:
        raise UserError(f"JSON cannot be read ({error})", file=file) from error
    return value
