"""The one exception for faults in a user's input; every other exception is a bug and keeps its traceback."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from lambent.core.plain import printable

LONGEST = 600  # characters of a message or a path


class UserError(Exception):
    """Input that cannot be used, reported in one line: file, field, found, expected, hint.

    `got` is cut to a length that fits a terminal, `expected` to four times that; the hint is shown whole.

    Parameters
    ----------
    message : str
        The fault, without a full stop.
    file, field : path-like and str, optional
        Its place: the file, and the field, key, option or line.
    got, expected : object, optional
        The value found there, and the values allowed there.
    hint : str, optional
        A remedy.
    """

    def __init__(
        self,
        message: str,
        *,
        file: str | Path | None = None,
        field: str | None = None,
        got: object = None,
        expected: object = None,
        hint: str | None = None,
    ) -> None:
        self.message, self.file, self.field = message, file, field
        self.got, self.expected, self.hint = got, expected, hint
        parts = [f"{_end_of(file)}: " if file is not None else "", f"{_short(field)}: " if field is not None else ""]
        parts.append(_short(message, LONGEST))
        if got is not None:
            parts.append(f"; found {_short(got)}")
        if expected is not None:
            parts.append(f"; expected {_short(expected, 4 * LONGEST)}")
        if hint is not None:
            parts.append(f"; {hint}")
        super().__init__(printable(" ".join("".join(parts).splitlines())))

    def _render_traceback_(self) -> list[str]:
        """In a notebook, the line alone: IPython asks for this."""
        return [f"UserError: {self}"]


TABLE, LIST, NUMBER = "a table of keys and values", "a list", "a number"
EXPECTED_TYPES = {
    "dict_type": TABLE,
    "model_type": TABLE,
    "dataclass_type": TABLE,
    "list_type": LIST,
    "tuple_type": LIST,
    "string_type": "text",
    "bool_type": "true or false",
    "float_type": NUMBER,
    "int_type": "a whole number",
    "bool_parsing": "true or false",
    "float_parsing": NUMBER,
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
}  # pydantic's error types, reworded: users write tables and lists, not dictionaries


def invalid(error: Any, file: str | Path, known: Iterable[str] = ()) -> UserError:
    """The first fault of a pydantic `ValidationError`; `known` are keys to suggest for an unknown one."""
    first = error.errors()[0]
    field = ".".join(str(part) for part in first["loc"]) or None
    if first["type"] == "extra_forbidden":
        return UserError("unknown key", file=file, field=field, hint=did_you_mean(str(first["loc"][-1]), known))
    if first["type"] == "missing":
        return UserError("is missing", file=file, field=field)
    got = None if isinstance(first["input"], dict) else first["input"]  # a table is too long to show
    if first["type"] == "union_tag_invalid":  # a table of one of several kinds
        tag, key = str(first["ctx"]["tag"]), first["ctx"]["discriminator"].strip("'")
        kinds = [kind.strip("' ") for kind in first["ctx"]["expected_tags"].split(",")]
        hint, expected = did_you_mean(tag, kinds), f"one of {', '.join(kinds)}"
        return UserError("unknown kind", file=file, field=f"{field}.{key}", got=tag, expected=expected, hint=hint)
    if first["type"] == "union_tag_not_found":
        return UserError("is missing", file=file, field=f"{field}.{first['ctx']['discriminator'].strip(chr(39))}")
    if first["type"] == "literal_error":
        return UserError("unknown value", file=file, field=field, got=got, expected=first["ctx"]["expected"])
    if first["type"] in EXPECTED_TYPES:
        expected = EXPECTED_TYPES[first["type"]]
        return UserError("has the wrong type", file=file, field=field, got=got, expected=expected)
    said = first["msg"].removeprefix("Value error, ").replace("Input should be", "must be")
    return UserError(said, file=file, field=field, got=got)


def did_you_mean(name: str, known: Iterable[str]) -> str | None:
    """Hint for a misspelt name, or None if no known name is close."""
    close = difflib.get_close_matches(name, list(known), n=1)
    return f"did you mean {_short(close[0])!r}?" if close else None


def _end_of(file: object) -> str:
    """A path; of a long one only its end, which has the file name."""
    text = str(file)
    return text if len(text) <= LONGEST else f"...{text[3 - LONGEST :]}"


def _short(value: object, limit: int = 120) -> str:
    try:
        text = str(value)
    except ValueError:  # Python refuses to write integers of more than 4300 digits
        text = "a number of more digits than can be shown"
    return text if len(text) <= limit else text[: limit - 3] + "..."
