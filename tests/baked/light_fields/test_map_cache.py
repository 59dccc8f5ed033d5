"""Caches of maps: answers by hand, room never exceeded, the adaptive one near the better of its two."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from lambent.baked.light_fields.map_cache import POLICIES, Adaptive, LeastRecent, ReadLast, misses


def test_least_recent_by_hand() -> None:
    cache = LeastRecent(2)
    assert [cache.read(name) for name in (1, 2, 1, 3, 2, 1)] == [False, False, True, False, False, False]


@pytest.mark.parametrize("policy", POLICIES)
def test_what_fits_is_read_once(policy: str) -> None:
    reads = [1, 2, 3, 4] * 10
    assert misses(reads, POLICIES[policy](4)) == 4
    assert misses([7] * 20, POLICIES[policy](1)) == 1


ALL = {**POLICIES, "read-last": ReadLast}


def test_a_cache_holds_what_it_said_and_no_more() -> None:
    """The last map it read, and at most as many as it has room for."""
    rng = np.random.default_rng(1)
    for name, capacity in itertools.product(ALL, (1, 2, 5, 16)):
        cache = ALL[name](capacity)
        for read in (rng.zipf(1.3, 3000) % 60).tolist():
            there = read in cache.held
            assert cache.read(read) == there and read in cache.held and len(cache.held) <= capacity


@pytest.mark.parametrize("policy", ALL)
def test_maps_to_keep_are_kept(policy: str) -> None:
    """Frames that need up to all there is room for, in any order."""
    rng = np.random.default_rng(5)
    for capacity in (1, 4, 20):
        cache = ALL[policy](capacity)
        for _ in range(300):
            wanted = rng.permutation(40)[: rng.integers(1, capacity + 1)].tolist()
            for name in wanted:
                cache.read(name, set(wanted))
            assert set(wanted) <= set(cache.held) and len(cache.held) <= capacity


def rows_of(maps: int, rows: int, shift: int) -> list[int]:
    """Reads of `rows` rows, each of `maps` maps that two pixels read; rows move on by one map every `shift` rows."""
    return [row // shift + column for row in range(rows) for column in range(maps) for _ in range(2)]


@pytest.mark.long
def test_the_adaptive_policy_is_near_the_better_one() -> None:
    """Also where maps are read by chance, or again and again nearby, and where the kind of reads changes."""
    rng = np.random.default_rng(4)
    by_chance = rng.integers(0, 200, 20_000).tolist()
    nearby = (np.abs(np.cumsum(rng.integers(-3, 4, 20_000))) % 300).tolist()
    for reads in (by_chance, nearby, rows_of(48, 120, 4), nearby + rows_of(48, 120, 4) + by_chance):
        for capacity in (8, 32):
            found = [misses(reads, make(capacity)) for make in (LeastRecent, ReadLast, Adaptive)]
            assert found[2] < 1.03 * min(found[:2]), (capacity, found)
    assert misses(nearby, LeastRecent(32)) < 0.8 * misses(nearby, ReadLast(32)), "otherwise nothing is shown"
