"""The text of an OBJ file as arrays, parsed in whole blocks of lines."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags, Floats, Indices, numbers_in
from lambent.core.ceilings import CORNERS, OBJ_BYTES
from lambent.core.errors import UserError
from lambent.core.inputs import decoded, read_bytes

BLOCK_BYTES = 8 << 20
Bytes = NDArray[np.uint8]
WIDTHS = {"v": 3, "vt": 2, "vn": 3}
# Slashes and double slashes of a corner of the form v, v/vt, v//vn, v/vt/vn; the place of each index, -1 for none.
FORMS = ((0, 0), (1, 0), (2, 1), (2, 0))
PLACES = np.array([(0, -1, -1), (0, 1, -1), (0, -1, 1), (0, 1, 2)])


@dataclass(frozen=True)
class ObjText:
    """The content of an OBJ file.

    Attributes
    ----------
    v, vt, vn : (N, 3), (N, 2), (N, 3)
        As written; missing numbers of vt are 0.
    corners : (C, 3) int64
        Indices from 0 into v, vt and vn of every corner of every face, -1 for none.
    sizes, lines : (F,) int64
        Number of corners of each face, and its line in the file.
    words : list of (line, keyword, rest)
        Every other line.
    coloured : bool
        Vertices have colours, which are not read.
    """

    v: Floats
    vt: Floats
    vn: Floats
    corners: Indices
    sizes: Indices
    lines: Indices
    words: list[tuple[int, str, str]]
    coloured: bool = False


def read(file: Path) -> ObjText:
    """The content of a file: see `parse`."""
    return parse(read_bytes(file, OBJ_BYTES), file)


def parse(data: bytes, file: Path) -> ObjText:
    """Parse a file's content into arrays.

    Raises
    ------
    UserError
        If a number is invalid, or a corner's index is out of range; names the line.
    """
    values: dict[str, list[Floats]] = {kind: [np.zeros((0, width))] for kind, width in WIDTHS.items()}
    counts = dict.fromkeys(WIDTHS, 0)
    faces = [(np.zeros((0, 3), np.int64), np.zeros(0, np.int64), np.zeros(0, np.int64))]
    words: list[tuple[int, str, str]] = []
    total, coloured = 0, False
    for first_line, block in _blocks(data):
        text = _Block(block, first_line, file)
        before = {}
        for kind, width in WIDTHS.items():
            at = text.lines_of(kind)
            values[kind].append(text.numbers(at, kind, width))
            before[kind] = counts[kind] + np.searchsorted(at, np.arange(len(text.starts)))
            counts[kind] += len(at)
        coloured = coloured or text.has_coloured_vertex()
        faces += text.faces(before)
        total += len(faces[-1][0])
        CORNERS.check(total, file=file)
        words += text.words()
    corners, sizes, lines = (np.concatenate(part) for part in zip(*faces, strict=True))
    for column, kind in enumerate(WIDTHS):
        over = np.flatnonzero(corners[:, column] >= counts[kind])
        if len(over):
            field = f"line {np.repeat(lines, sizes)[over[0]]}"
            got, most = int(corners[over[0], column]) + 1, f"at most {counts[kind]}"
            raise UserError(f"corner has an unknown {kind}", file=file, field=field, got=got, expected=most)
    v, vt, vn = (np.concatenate(values[kind]) for kind in WIDTHS)
    return ObjText(v, vt, vn, corners, sizes, lines, words, coloured)


def _blocks(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield blocks of whole lines, some megabytes each, with the number of the first line."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    start, line = 0, 1
    while start < len(data):
        end = data.find(b"\n", min(start + BLOCK_BYTES, len(data) - 1))
        while end > 0 and data[end - 1 : end] == b"\\":  # a line continues on the next
            end = data.find(b"\n", end + 1)
        end = len(data) if end < 0 else end + 1
        block = data[start:end]
        yield line, block
        line += block.count(b"\n")
        start = end


class _Block:
    """A block of lines, and the positions where its lines begin and end."""

    def __init__(self, block: bytes, first_line: int, file: Path) -> None:
        if b"\\\n" in block:  # empty lines replace continued ones, to keep line numbers
            block = re.sub(rb"(?m)^(?:[^\n]*\\\n)+[^\n]*\n?", _joined, block)
        block = block.translate(_BLANKS)
        if block.startswith(b" ") or b"\n " in block:
            block = re.sub(rb"(?m)^ +", b"", block)
        self.bytes: Bytes = np.frombuffer(block + b"\n\n\n", np.uint8)
        self.ends = np.flatnonzero(self.bytes == 10)
        self.starts = np.concatenate([[0], self.ends[:-1] + 1])
        self.first_line, self.file = first_line, file
        here, after = self.starts[:-2], len(self.bytes) - 1
        self._head = [self.bytes[np.minimum(here + i, after)] for i in range(3)]
        self._kinds = {
            "v": self._begins(b"v "), "vt": self._begins(b"vt "), "vn": self._begins(b"vn "), "f": self._begins(b"f ")
        }  # fmt: skip

    def _begins(self, word: bytes) -> Indices:
        matches = np.logical_and.reduce([self._head[i] == c for i, c in enumerate(word)])
        return np.flatnonzero(matches)

    def lines_of(self, kind: str) -> Indices:
        return self._kinds[kind]

    def _text(self, lines: Indices, kind: str) -> bytes:
        """The lines without keyword and comments, each with its line end."""
        breaks = np.flatnonzero(np.diff(lines) > 1) + 1  # lines of one kind are mostly consecutive
        first, last = lines[np.concatenate([[0], breaks])], lines[np.concatenate([breaks, [len(lines)]]) - 1]
        whole = self.bytes.data
        text = b"".join([whole[a:b] for a, b in zip(self.starts[first], self.ends[last] + 1, strict=True)])
        word = b"\n" + kind.encode() + b" "
        text = (b"\n" + text).replace(word, b"\n")[1:]
        return re.sub(rb"#[^\n]*", b"", text) if b"#" in text else text

    def numbers(self, lines: Indices, kind: str, width: int) -> Floats:
        """(N, width) numbers of lines of one kind; more than `width` on a line are ignored."""
        if not len(lines):
            return np.zeros((0, width))
        text = self._text(lines, kind)
        per_line = _tokens(text)
        few = per_line < (1 if kind == "vt" else width)
        if few.any():
            raise self._error(f"{kind} with too few numbers", lines[int(np.argmax(few))])
        values = self._parsed(text, float, lines)
        if (per_line == width).all():
            return values.reshape(-1, width)
        index = (np.cumsum(per_line) - per_line)[:, None] + np.arange(width)
        given = np.arange(width) < per_line[:, None]
        return np.where(given, values[np.minimum(index, len(values) - 1)], 0.0)

    def has_coloured_vertex(self) -> bool:
        """Whether the block's first vertex has six numbers or more."""
        first = self.lines_of("v")[:1]
        return len(first) > 0 and int(_tokens(self._text(first, "v"))[0]) >= 6

    def faces(self, before: dict[str, Indices]) -> Iterator[tuple[Indices, Indices, Indices]]:
        """Corners, sizes and lines of the faces; `before` counts v, vt and vn before each line."""
        lines = self.lines_of("f")
        if not len(lines):
            return
        text = self._text(lines, "f")
        if b"/ " in text or b"/\n" in text:  # 1// and 1/2/, as some exporters write corners without normals
            text = re.sub(rb"/+(?=\s)", b"", text)
        sizes, form = _tokens(text), _forms(text)
        face = np.repeat(np.arange(len(lines)), sizes)
        first = np.minimum(np.cumsum(sizes) - sizes, max(len(form) - 1, 0))
        bad = sizes == 0
        bad[face[(form < 0) | (form != form[first[face]])]] = True
        width = (PLACES[form] >= 0).sum(axis=1)
        text = text.replace(b"/", b" ")
        bad |= _tokens(text) != np.bincount(face, width, minlength=len(lines))
        if bad.any():
            raise self._error("face cannot be read", lines[int(np.argmax(bad))])
        values = self._parsed(text, np.int64, lines)
        corners = np.full((len(form), 3), -1, np.int64)
        for column, kind in enumerate(WIDTHS):
            named = PLACES[form, column] >= 0
            index = values[(np.cumsum(width) - width + PLACES[form, column])[named]]
            line = lines[face[named]]
            place = np.where(index > 0, index - 1, before[kind][line] + index)
            wrong = (index == 0) | (place < 0)
            if wrong.any():
                at = int(np.argmax(wrong))
                raise self._error(f"corner has an unknown {kind}", line[at], int(index[at]))
            corners[named, column] = place
        yield corners, sizes, lines + self.first_line

    def words(self) -> list[tuple[int, str, str]]:
        """(line, keyword, rest) of every other line that is not a comment."""
        other = np.ones(len(self._head[0]), bool)
        for lines in self._kinds.values():
            other[lines] = False
        other &= (self._head[0] != ord("#")) & (self._head[0] != 10)
        found = []
        for i in np.flatnonzero(other):
            line = decoded(self.bytes[self.starts[i] : self.ends[i]].tobytes())
            word, _, rest = line.partition(" ")
            found.append((int(i) + self.first_line, word, rest.strip()))
        return found

    def _parsed(self, text: bytes, kind: type, lines: Indices) -> np.ndarray[Any, Any]:
        if (values := numbers_in(text, kind)) is not None:
            return values
        for line, words in zip(lines, text.split(b"\n"), strict=False):
            for word in words.split():
                try:
                    (int if kind is np.int64 else float)(word)
                except ValueError:
                    raise self._error("not a number", line, word.decode("utf-8", "replace")) from None
        raise self._error("not a number", lines[0])

    def _error(self, message: str, line: int, got: object = None) -> UserError:
        return UserError(message, file=self.file, field=f"line {int(line) + self.first_line}", got=got)


_BLANKS = bytes(32 if c in b"\t\v\f\0" else c for c in range(256))


def _joined(match: re.Match[bytes]) -> bytes:
    """Join continued lines, followed by empty ones that keep the count."""
    return match[0].replace(b"\\\n", b" ").rstrip(b"\n") + b"\n" * match[0].count(b"\n")


def _per_line(marks: Flags, ends: Indices) -> Indices:
    """Number of marks on each line; `ends` are the lines' ends."""
    return np.diff(np.searchsorted(np.flatnonzero(marks), ends), prepend=0)


def _begins(flat: Bytes) -> Flags:
    """Flags of the first letter of each word."""
    blank = flat <= 32
    return np.asarray(~blank & np.concatenate([[True], blank[:-1]]))


def _tokens(text: bytes) -> Indices:
    """Number of words per line."""
    flat = np.frombuffer(text, np.uint8)
    return _per_line(_begins(flat), np.flatnonzero(flat == 10))


def _forms(text: bytes) -> Indices:
    """The form of each corner as an index of `FORMS`, -1 if it has none."""
    flat = np.frombuffer(text, np.uint8)
    starts = np.flatnonzero(_begins(flat))
    slash = flat == 47
    double = slash & np.concatenate([slash[1:], [False]])
    bounds = np.append(starts, len(flat))
    slashes, doubles = (np.diff(np.searchsorted(np.flatnonzero(marks), bounds)) for marks in (slash, double))
    codes = np.full(len(starts), -1)
    for code, (single, twice) in enumerate(FORMS):
        codes[(slashes == single) & (doubles == twice)] = code
    return codes
