"""Numbers of a text."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.arrays import numbers_in


@pytest.mark.parametrize("text", [b"", b"  \n", b"1", b" -1.5e3\t+2\n\nnan 7 \n", b"inf -0 .5"])
def test_numbers_are_those_of_the_words(text: bytes) -> None:
    np.testing.assert_array_equal(numbers_in(text), np.array(text.split(), float))


@pytest.mark.parametrize("text", [b"- 1", b"1 + 2", b"1.2.3", b"3-4", b"1,5", b"x", b"1 \xff", b"1e", b"\x00 1"])
def test_a_word_that_is_no_number_is_seen(text: bytes) -> None:
    assert numbers_in(text) is None
    assert numbers_in(text, np.int64) is None
