"""Multisets: their number, and that orders of the same members have the same; tails of paths by hand."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
import pytest

from lambent.baked.transport.multisets import Multisets
from lambent.baked.transport.tails import SecondBands, Tails


@pytest.mark.parametrize(
    ("members", "size", "count"), [(6, 3, 56), (6, 0, 1), (1, 4, 1), (3, 2, 6), (0, 0, 1), (0, 2, 0)]
)
def test_there_are_as_many_as_combinatorics_says(members: int, size: int, count: int) -> None:
    sets = Multisets(members, size)
    assert len(sets) == count == len(sets.exponents)
    assert (sets.exponents.sum(axis=1) == size).all()


def test_orders_have_the_number_of_their_members() -> None:
    sets = Multisets(4, 3)
    for order in product(range(4), repeat=3):
        number = sets.number_of_order[order[0] * 16 + order[1] * 4 + order[2]]
        assert sets.exponents[number].tolist() == [order.count(member) for member in range(4)]
        for other in permutations(order):
            assert sets.number_of_order[other[0] * 16 + other[1] * 4 + other[2]] == number


def test_tails_of_two_materials_and_at_most_three_surfaces() -> None:
    """With two bands of the second surface, the others are on paths of three surfaces alone."""
    slots = (("red", "reflection"), ("grey", "reflection"))
    whole, banded = Tails(slots, 3), Tails(slots, 3, (SecondBands("red", 0, (2,)),))
    assert whole.hits.tolist() == [2, 2, 3, 3, 3] and len(whole) == 5
    assert np.allclose(whole.weights(np.array([[0.5], [0.2]]))[:, 0], [0.5, 0.2, 0.25, 0.1, 0.04])
    assert banded.hits.tolist() == [2, 2, 3, 3, 3, 3] and banded.band_of_second.tolist() == [0, 1, 0, 0, 1, 1]
    second = np.array([[1.0], [10.0]])
    assert np.allclose(banded.weights(np.array([[0.5], [0.2]]), second)[:, 0], [1, 10, 0.5, 0.2, 5, 2])
