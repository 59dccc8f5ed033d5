"""Plain values: results for JSON, words that are numbers, triples of floats, names for files."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

_UNSHOWN = ("Cc", "Cf", "Cs", "Zl", "Zp")  # categories of Unicode
Triple = tuple[float, float, float]


def plain(value: Any) -> Any:
    """`value` for JSON: arrays and tuples as lists, paths as text, numbers that are not finite as null."""
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
    """`text` as one line that a terminal shows and does not obey, `\\x1b` for an escape.

    Escaped are control characters, line ends among them, marks that change the direction of writing or have no width,
    and halves of characters.
    """
    return "".join(c if unicodedata.category(c) not in _UNSHOWN else ascii(c)[1:-1] for c in text)


def is_number(word: str) -> bool:
    """Whether Python reads the word as a number, nan and inf included."""
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
    """A file name for any name from a user or a file; `otherwise` if nothing of it is left."""
    return "".join(c if c.isalnum() or c in " ._-" else "_" for c in name).strip(" .") or otherwise
