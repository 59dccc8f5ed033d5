"""Lists of names in a line of text."""

from __future__ import annotations

import pytest

from lambent.core.plain import first_of


@pytest.mark.parametrize(
    ("names", "text"),
    [
        ((), ""),
        (("a",), "a"),
        (("a", "b"), "a and b"),
        (("a", "b", "c", "d"), "a, b, c and d"),
        (("a", "b", "c", "d", "e"), "a, b, c and 2 more"),
        ([f"n{k}" for k in range(10_003)], "n0, n1, n2 and 10,000 more"),
    ],
)
def test_few_names_are_all_listed_and_many_are_counted(names: list[str], text: str) -> None:
    assert first_of(names) == text
