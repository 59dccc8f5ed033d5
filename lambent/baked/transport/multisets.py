"""Multisets: how often each member occurs, regardless of order.

The light of a path depends on how often it hit each object, not on the order (Ben-Artzi 2007, section 5.2): there are
binom(size + members - 1, size) multisets, but members^size orders.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations_with_replacement
from math import comb

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Multisets:
    """All multisets of `size` out of `members`, numbered in lexicographic order."""

    members: int
    size: int

    def __len__(self) -> int:
        return comb(self.size + self.members - 1, self.size) if self.members else int(self.size == 0)

    @cached_property
    def exponents(self) -> NDArray[np.int64]:
        """(count, members): how often each member occurs."""
        found = combinations_with_replacement(range(self.members), self.size)
        rows = [np.bincount(np.array(one, np.int64), minlength=self.members) for one in found]
        return np.array(rows, np.int64).reshape(len(self), self.members)

    @cached_property
    def number_of_order(self) -> NDArray[np.int64]:
        """(members^size,) multiset number of each order, read as a number in base `members`."""
        orders = np.arange(self.members**self.size)
        digits = orders[:, None] // self.members ** np.arange(self.size)[::-1] % max(self.members, 1)
        counts = np.sort(digits, axis=1) @ self.members ** np.arange(self.size)[::-1]
        return np.asarray(np.unique(counts, return_inverse=True)[1].reshape(-1))
