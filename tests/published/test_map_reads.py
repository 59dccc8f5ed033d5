"""The optimal cache by exhaustion; misses of items that are read in part, by hand."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baked.light_fields.map_cache import POLICIES, LeastRecent, misses
from lambent.published.map_reads import KnownFuture, fewest_misses, partial_misses


def test_the_future_is_known_by_exhaustion() -> None:
    """Against all choices of what to drop, for short reads."""
    rng = np.random.default_rng(2)
    for _ in range(40):
        reads, capacity = rng.integers(0, 5, 9).tolist(), int(rng.integers(1, 4))
        assert fewest_misses(reads, capacity) == _least(reads, frozenset(), capacity)


def _least(reads: list[int], held: frozenset[int], capacity: int) -> int:
    if not reads:
        return 0
    name, rest = reads[0], reads[1:]
    if name in held:
        return _least(rest, held, capacity)
    if len(held) < capacity:
        return 1 + _least(rest, held | {name}, capacity)
    return 1 + min(_least(rest, (held - {out}) | {name}, capacity) for out in held)


@pytest.mark.parametrize("policy", POLICIES)
def test_nothing_is_better_than_knowing_the_future(policy: str) -> None:
    reads = (np.random.default_rng(3).zipf(1.2, 4000) % 200).tolist()
    for capacity in (1, 3, 20, 150):
        assert misses(reads, POLICIES[policy](capacity)) >= fewest_misses(reads, capacity) >= len(set(reads))


def test_reads_on_demand_miss_what_was_not_read_of_an_item() -> None:
    reads = [(1, 3), (1, 2), (1, 4), (2, 0), (3, 0), (2, 0), (1, 0)]
    assert partial_misses(reads, LeastRecent(2)) == 5 and partial_misses(reads, LeastRecent(3)) == 4
    items = [item for item, _ in reads]
    assert partial_misses(reads, KnownFuture(items, 2)) == 5 and partial_misses(reads, KnownFuture(items, 3)) == 4
