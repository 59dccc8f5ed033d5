"""Numbers in text files of any line end: what the text formats share, decimal commas and other encodings included."""

from __future__ import annotations

import codecs
import re
from pathlib import Path

import numpy as np

from lambent.core.directions import Floats
from lambent.core.errors import UserError
from lambent.core.files import read_bytes

LIMIT_BYTES = 1 << 30
_UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_BINARY = re.compile(rb"[\x00-\x08\x0e-\x1f]")
_DECIMAL_COMMA = re.compile(rb"(?:^|[\s;])[-+]?\d+,\d+(?:[eE][-+]?\d+)?(?=[\s;]|$)")
_COMMENT = re.compile(rb"#[^\n]*")
HINT_DECIMAL_COMMA = "replace the decimal commas by points, and separate the columns by blanks or semicolons"


def plain_text(content: bytes) -> bytes:
    """`content` without a byte order mark, lines ended by a line feed alone."""
    return content.removeprefix(codecs.BOM_UTF8).replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def head_text(head: bytes) -> bytes | None:
    """The same of the first bytes of a file, or None where they are no text."""
    return None if _BINARY.search(head) else plain_text(head)


def read_text(path: Path, limit_bytes: int = LIMIT_BYTES) -> bytes:
    """A file's text, lines ended by a line feed alone.

    Raises
    ------
    UserError
        Where it cannot be read, is too large, or is in an encoding of two bytes per character.
    """
    content = read_bytes(path, limit_bytes)
    if content.startswith(_UTF16):
        raise UserError("is UTF-16", file=path, expected="plain text or UTF-8", hint="save it again as UTF-8")
    return plain_text(content)


def without_comments(text: bytes) -> bytes:
    """`text` with blanks in place of what `#` begins, to the end of the line."""
    return _COMMENT.sub(b"", text) if b"#" in text else text


def numbers(text: bytes, path: Path, field: str | None = None) -> Floats:
    """(N,) float64 of the numbers in `text`, separated by blanks and line ends.

    Raises
    ------
    UserError
        Where a word is not a number, with that word; decimal commas are named as such.
    """
    if not text.strip():
        return np.empty(0)
    try:
        return np.fromstring(text, dtype=np.float64, sep=" ")
    except ValueError:
        pass  # the slow way below says which word it was
    for match in re.finditer(rb"\S+", text):
        try:
            float(match[0])
        except ValueError as error:
            word = match[0].decode("utf-8", "replace")
            hint = HINT_DECIMAL_COMMA if has_decimal_commas(text) else None
            raise UserError("holds a word that is not a number", file=path, field=field, got=word, hint=hint) from error
    raise UserError("holds numbers that cannot be read", file=path, field=field)


def has_decimal_commas(text: bytes) -> bool:
    """Whether numbers such as 0,25 stand between blanks or semicolons."""
    return _DECIMAL_COMMA.search(text) is not None
