"""Shared by the text formats: text of any line ending, its numbers, and checks for decimal commas and encodings."""

from __future__ import annotations

import codecs
import math
import re
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats, numbers_in
from lambent.core.ceilings import MEASURED_BYTES
from lambent.core.errors import UserError
from lambent.core.inputs import read_bytes

UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_BINARY = re.compile(rb"[\x00-\x08\x0e-\x1f]")
_DECIMAL_COMMA = re.compile(rb"(?:^|[\s;])[-+]?\d+,\d+(?:[eE][-+]?\d+)?(?=[\s;]|$)")
_COMMENT = re.compile(rb"(?<![^\s,;])#[^\n]*")  # not the `#` of Windows' 1.#QNAN
HINT_QUANTITY = "name the columns in the first line: theta_i phi_i theta_o phi_o, then f, f_cos or p"
HINT_SPECTRAL = "put the quantity before each wavelength: f_550nm, f_cos_550nm or p_550nm"
HINT_PERCENT = "f is R / (100 pi) of a reflectance factor R in percent"
HINT_DECIMAL_COMMA = "replace the decimal commas by points, and separate the columns by blanks or semicolons"


def plain_text(content: bytes) -> bytes:
    """`content` without a byte order mark, with line feeds as the only line ends."""
    return content.removeprefix(codecs.BOM_UTF8).replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def head_text(head: bytes) -> bytes | None:
    """`plain_text` of the first bytes of a file, or None for a binary file."""
    return None if _BINARY.search(head) else plain_text(head)


def begins_with(pattern: re.Pattern[bytes], head: bytes) -> bool:
    """Whether the first bytes of a file are text that, comments aside, begins with the pattern."""
    text = head_text(head)
    return text is not None and pattern.match(without_comments(text)) is not None


def read_text(path: Path, limit_bytes: int = MEASURED_BYTES) -> bytes:
    """A file's `plain_text`.

    Raises
    ------
    UserError
        The file cannot be read, is too large, or is UTF-16.
    """
    content = read_bytes(path, limit_bytes)
    if content.startswith(UTF16):
        raise is_utf16(path)
    return plain_text(content)


def is_utf16(path: Path) -> UserError:
    """The error for a file in UTF-16."""
    return UserError("is UTF-16", file=path, expected="plain text or UTF-8", hint="save it again as UTF-8")


def without_comments(text: bytes) -> bytes:
    """`text` without comments, which run from `#` to the end of the line."""
    return _COMMENT.sub(b"", text) if b"#" in text else text


def shown(text: bytes) -> str:
    """Bytes of a user's file as text for parsing and messages; invalid UTF-8 is replaced."""
    return text.decode("utf-8", "replace")


def numbers(text: bytes, path: Path, field: str | None = None) -> Floats:
    """(N,) float64 of the numbers in `text`, separated by blanks and line ends.

    Raises
    ------
    UserError
        A word is not a number; the message names it, and decimal commas as such.
    """
    if (found := numbers_in(text)) is not None:
        return found
    for match in re.finditer(rb"\S+", text):
        try:
            float(match[0])
        except ValueError as error:
            word = shown(match[0])
            hint = HINT_DECIMAL_COMMA if has_decimal_commas(text) else None
            raise UserError("has a word that is not a number", file=path, field=field, got=word, hint=hint) from error
    raise UserError("has numbers that cannot be read", file=path, field=field)


def counted(text: bytes, shape: tuple[int, ...], path: Path, field: str, of: str = "") -> Floats:
    """The numbers of a text as an array of this shape, `of` in words; `UserError` if there are more or fewer."""
    found, expected = numbers(text, path, field), math.prod(shape)
    if len(found) != expected:
        wanted = f"{' x '.join(map(str, shape))} {of}".strip()
        raise UserError("wrong number of values", file=path, field=field, got=len(found), expected=wanted)
    return found.reshape(shape)


def angles_after(keyword: str, low: float, high: float, head: bytes, path: Path) -> Floats:
    """(N,) angles that a header lists after a keyword and their number.

    Raises
    ------
    UserError
        The keyword is missing, the number differs, or the angles do not increase from `low` to at most `high`.
    """
    found = re.search(rb"\b" + keyword.encode() + rb"((?:\s+[-+.,\deE]+)*)", head, re.IGNORECASE)
    if found is None:
        raise UserError("is missing", file=path, field=keyword)
    count, *angles = numbers(found[1], path, keyword) if found[1].strip() else [np.nan]
    if not angles or count != len(angles):
        got = f"{count:g} and {len(angles)}"
        raise UserError("count differs from the number of angles", file=path, field=keyword, got=got)
    if not ((np.diff(angles) > 0).all() and low <= angles[0] and angles[-1] <= high):
        expected = f"increasing degrees from {low:g} to {high:g}"
        raise UserError("is not a list of angles", file=path, field=keyword, got=angles, expected=expected)
    return np.array(angles)


def refuse_decimal_commas(text: bytes, path: Path) -> None:
    if has_decimal_commas(text):
        raise UserError("numbers have decimal commas", file=path, hint=HINT_DECIMAL_COMMA)


def has_decimal_commas(text: bytes) -> bool:
    """Whether there are numbers such as 0,25 between blanks or semicolons."""
    return _DECIMAL_COMMA.search(text) is not None
