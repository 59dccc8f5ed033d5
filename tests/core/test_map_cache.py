"""Caches of maps: answers by hand, room never exceeded, nothing better than knowing the future."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from lambent.core.map_cache import POLICIES, Adaptive, LeastRecent, fewest_misses, misses


def test_least_recent_by_hand() -> None:
    cache = LeastRecent(2)
    assert [cache.read(name) for name in (1, 2, 1, 3, 2, 1)] == [False, False, True, False, False, False]


@pytest.mark.parametrize("policy", POLICIES)
def test_what_fits_is_read_once(policy: str) -> None:
    reads = [1, 2, 3, 4] * 10
    assert misses(reads, POLICIES[policy](4)) == 4
    assert misses([7] * 20, POLICIES[policy](1)) == 1


def test_a_cache_holds_what_it_said_and_no_more() -> None:
    """A cache of c maps has at least the last map it read, and at most c of those it ever read."""
    rng = np.random.default_rng(1)
    for name, capacity in itertools.product(POLICIES, (1, 2, 5, 16)):
        cache = POLICIES[name](capacity)
        for read in (rng.zipf(1.3, 3000) % 60).tolist():
            cache.read(read)
            assert cache.read(read)
        held = sum(_there(cache, other) for other in range(60))
        assert 1 <= held <= capacity


def _there(cache: object, name: int) -> bool:
    lists = [cache._maps] if isinstance(cache, LeastRecent) else [cache._once, cache._again]  # type: ignore[attr-defined]
    return any(name in names for names in lists)


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


def test_maps_wanted_again_outlive_those_that_pass_through() -> None:
    passing = iter(range(100, 10_000))
    reads = [name for _ in range(200) for name in (1, 2, 3, 1, 2, 3, *(next(passing) for _ in range(6)))]
    assert misses(reads, Adaptive(8)) < 0.75 * misses(reads, LeastRecent(8))
