"""Errors of a user are one line, whatever the file that they quote."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import pytest
from pydantic import Field, TypeAdapter, ValidationError

from lambent.core.errors import UserError, invalid
from lambent.core.inputs import foreign_bytes


@pytest.mark.parametrize("end", ["\n", "\r", "\r\n", "\v", "\x1c", "\x85", "\u2028"])
def test_errors_are_one_line(end: str) -> None:
    said = str(UserError(f"a{end}b", file=f"c{end}d", field=f"e{end}f", got=f"g{end}h", expected=f"i{end}j", hint="k"))
    assert said.splitlines() == [said]
    assert said == "c d: e f: a b; found g h; expected i j; k"


@pytest.mark.parametrize(
    "error",
    [KeyError("a"), TypeError("b\nc"), ZeroDivisionError(), AttributeError("d" * 5000), RecursionError(), OSError()],
)
def test_whatever_a_reader_raises_names_the_file_and_the_reader(error: Exception) -> None:
    with pytest.raises(UserError) as caught, foreign_bytes("the reader", Path("a.bin")):
        raise error
    said = str(caught.value)
    assert said.startswith("a.bin: cannot be read as the reader") and type(error).__name__ in said
    assert said.splitlines() == [said] and len(said) < 300


def test_what_is_no_fault_of_the_bytes_passes() -> None:
    for error in (UserError("known"), KeyboardInterrupt()):
        with pytest.raises(type(error)) as caught, foreign_bytes("the reader", Path("a.bin")):
            raise error
        assert caught.value is error


@pytest.mark.parametrize(
    ("kind", "value", "words"),
    [
        (dict[str, dict[str, int]], {"red": "oak"}, "red: has the wrong type; found oak; expected a table of keys"),
        (list[int], 3, "has the wrong type; found 3; expected a list"),
        (dict[str, list[int]], {"a": {"b": 1}}, "a: has the wrong type; expected a list"),
        (dict[str, str], {"a": 3}, "a: has the wrong type; found 3; expected text"),
        (dict[str, float], {"a": "bright"}, "a: has the wrong type; found bright; expected a number"),
        (Annotated[int, Field(gt=0)], 0, "must be greater than 0; found 0"),
        (Literal[1], 99, "unknown value; found 99; expected 1"),
    ],
)
def test_a_value_of_another_type_is_said_in_the_words_of_files(kind: type, value: object, words: str) -> None:
    with pytest.raises(ValidationError) as raised:
        TypeAdapter(kind).validate_python(value)
    assert words in str(invalid(raised.value, "scene.toml"))


def test_names_from_files_cannot_steer_a_terminal_or_hide() -> None:
    """Where the line is shown by Python or a notebook, too."""
    name = "oak\x1b]0;title\x07\r\n\u202egnp.\u200b\x9b2J"
    for said in (str(UserError(name, file=name, field=name, got=name, expected=name, hint=name)),):
        assert said.isprintable() and said.count("\\x1b]0;title\\x07") == 6 and "\\u202e" in said
