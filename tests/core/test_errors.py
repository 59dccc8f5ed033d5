"""Errors of a user are one line, whatever the file that they quote."""

from __future__ import annotations

import pytest

from lambent.core.errors import UserError


@pytest.mark.parametrize("end", ["\n", "\r", "\r\n", "\v", "\x1c", "\x85", "\u2028"])
def test_errors_are_one_line(end: str) -> None:
    said = str(UserError(f"a{end}b", file=f"c{end}d", field=f"e{end}f", got=f"g{end}h", expected=f"i{end}j", hint="k"))
    assert said.splitlines() == [said]
    assert said == "c d: e f: a b; found g h; expected i j; k"
