"""Plain values: JSON-ready results, words that are numbers, tuples of floats, lists of names, unique and file names."""

from __future__ import annotations

import hashlib
import math
import unicodedata
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

_UNSHOWN = ("Cc", "Cf", "Cs", "Zl", "Zp")  # categories of Unicode
Triple = tuple[float, float, float]

LONGEST, LETTERS = 200, 40  # bytes of a name that a folder has as it is; letters of others


def plain(value: Any) -> Any:
    """`value` for JSON: arrays and tuples as lists, paths as text, non-finite numbers as null."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):  # numpy
        return plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return str(value) if isinstance(value, Path) else value


def printable(text: str) -> str:
    """`text` as one line that is safe to print on a terminal; an escape character becomes `\\x1b`.

    Escapes control characters, line ends among them, bidirectional and zero-width marks, and lone surrogates.
    """
    return "".join(c if unicodedata.category(c) not in _UNSHOWN else ascii(c)[1:-1] for c in text)


def first_of(names: Sequence[str], most: int = 3) -> str:
    """`names` in a line of text: all of them, or the first `most` and the count of the rest."""
    if len(names) <= most + 1:
        return " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))
    return f"{', '.join(names[:most])} and {len(names) - most:,} more"


def is_number(word: str) -> bool:
    """Whether Python parses the word as a number, nan and inf included."""
    try:
        float(word)
    except ValueError:
        return False
    return True


def triple(values: Iterable[Any]) -> Triple:
    """Three numbers of an array as plain floats."""
    x, y, z = (float(v) for v in values)
    return x, y, z


def quad(values: Iterable[Any]) -> tuple[float, float, float, float]:
    """Four numbers of an array as plain floats."""
    a, b, c, d = (float(v) for v in values)
    return a, b, c, d


def plain_name(name: str, otherwise: str = "material") -> str:
    """A file name made from any user-supplied name; `otherwise` if no character survives."""
    return "".join(c if c.isalnum() or c in " ._-" else "_" for c in name).strip(" .") or otherwise


def as_folder(name: str) -> str:
    """`name`, if folders can have it, else its first letters and a hash of all: file systems take 255 bytes a name."""
    parts = name.split("/")
    if name.isprintable() and all(part not in ("", ".", "..") and len(part.encode()) <= LONGEST for part in parts):
        return name
    letters = "".join(letter if letter.isalnum() else "_" for letter in name[:LETTERS])
    return f"{letters}-{hashlib.sha256(name.encode('utf-8', 'surrogatepass')).hexdigest()[:16]}"


class UniqueNames:
    """Makes names unique; those in `taken` are in use already."""

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._taken = set(taken)
        self._tried: Counter[str] = Counter()

    def unique(self, name: str) -> str:
        """`name`, or the first free one of name_2, name_3...

        The search resumes where it ended, so that the thousandth object of a name costs as much as the second.
        """
        candidate = name
        while candidate in self._taken:
            self._tried[name] += 1
            candidate = f"{name}_{self._tried[name] + 1}"
        self._taken.add(candidate)
        return candidate
