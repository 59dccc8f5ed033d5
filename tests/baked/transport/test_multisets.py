"""Multisets: their number, and that orders of the same members have the same."""

from __future__ import annotations

from itertools import permutations, product

import pytest

from lambent.baked.transport.multisets import Multisets


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
