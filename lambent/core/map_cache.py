"""Map caches with a fixed budget: eviction policies and miss counts.

Each read names one map. `LeastRecent` is the thesis's policy (R, section 4.3). `Adaptive` also keeps repeatedly read
maps while others pass through once (Megiddo & Modha 2003, "ARC"). `fewest_misses` is the lower bound for any policy.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Collection, Sequence
from heapq import heappop, heappush
from typing import Protocol

NEVER = 1 << 62


class MapCache(Protocol):
    """A cache of at most `capacity` maps."""

    capacity: int

    def read(self, name: int) -> bool:
        """Read a map into the cache; returns whether it was there already."""
        ...

    @property
    def held(self) -> Collection[int]:
        """The maps in the cache."""
        ...


class LeastRecent:
    """Evicts the least recently read map (LRU)."""

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self._maps: OrderedDict[int, None] = OrderedDict()

    def read(self, name: int) -> bool:
        there = name in self._maps
        self._maps[name] = None
        self._maps.move_to_end(name)
        if len(self._maps) > self.capacity:
            self._maps.popitem(last=False)
        return there

    @property
    def held(self) -> Collection[int]:
        return self._maps.keys()


class Adaptive:
    """Splits its capacity between maps read once and maps read repeatedly (ARC).

    A miss on a recently evicted map enlarges the share of the list that it was evicted from.
    """

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self._once_share = 0.0
        self._once, self._again, self._left_once, self._left_again = (OrderedDict[int, None]() for _ in range(4))

    def read(self, name: int) -> bool:
        there = name in self._once or name in self._again
        if there:
            (self._once if name in self._once else self._again).pop(name)
        elif name in self._left_once:
            step = max(1.0, len(self._left_again) / len(self._left_once))
            self._once_share = min(self._once_share + step, self.capacity)
            self._make_room(False)
            del self._left_once[name]
        elif name in self._left_again:
            step = max(1.0, len(self._left_once) / len(self._left_again))
            self._once_share = max(self._once_share - step, 0.0)
            self._make_room(True)
            del self._left_again[name]
        else:
            self._forget()
            self._once[name] = None
            return False
        self._again[name] = None
        return there

    @property
    def held(self) -> Collection[int]:
        return self._once.keys() | self._again.keys()

    def _forget(self) -> None:
        """Make room for a map without history, in the cache and in the lists of evicted maps."""
        if len(self._once) + len(self._left_once) == self.capacity:
            if len(self._once) < self.capacity:
                self._left_once.popitem(last=False)
                self._make_room(False)
            else:
                self._once.popitem(last=False)
            return
        lists = self._once, self._again, self._left_once, self._left_again
        known = sum(len(names) for names in lists)
        if known >= self.capacity:
            if known == 2 * self.capacity:
                self._left_again.popitem(last=False)
            self._make_room(False)

    def _make_room(self, regret_again: bool) -> None:
        if len(self._once) + len(self._again) < self.capacity:
            return
        many = len(self._once) > self._once_share or (regret_again and len(self._once) == self._once_share)
        source, left = (self._once, self._left_once) if self._once and (many or not self._again) else (
            self._again, self._left_again)  # fmt: skip
        left[source.popitem(last=False)[0]] = None


def misses(reads: Sequence[int], cache: MapCache) -> int:
    """Number of `reads` that miss when run through `cache` in order."""
    return sum(not cache.read(name) for name in reads)


def fewest_misses(reads: Sequence[int], capacity: int) -> int:
    """Misses of the optimal policy, which knows the future and evicts the map read again last (Belady 1966)."""
    following, seen = [NEVER] * len(reads), dict[int, int]()
    for at in range(len(reads) - 1, -1, -1):
        following[at] = seen.get(reads[at], NEVER)
        seen[reads[at]] = at
    held, queue, missed = dict[int, int](), list[tuple[int, int]](), 0
    for name, again in zip(reads, following, strict=True):
        if name not in held:
            missed += 1
            while len(held) >= capacity:
                when, last = heappop(queue)
                if held.get(last) == -when:
                    del held[last]
        held[name] = again
        heappush(queue, (-again, name))
    return missed


LEAST_RECENT = "least-recent"
POLICIES: dict[str, Callable[[int], MapCache]] = {LEAST_RECENT: LeastRecent, "adaptive": Adaptive}
