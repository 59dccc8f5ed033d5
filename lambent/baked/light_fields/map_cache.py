"""Map caches with a fixed budget: eviction policies and miss counts.

Each read names one map. `LeastRecent` is the thesis's policy (R, section 4.3); rows of pixels that need more maps than
there is room for defeat it, since it evicts the map that the next row needs first. `ReadLast` expects maps to be read
again as regularly as before. `Adaptive` follows the better of both.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Collection, Sequence
from typing import Protocol

NEIGHBOURS = 8  # maps that neighbouring pixels read together: four points each, at most half of the cache
REMEMBERED = 8  # times the capacity: maps whose intervals are kept
USUAL = 1 / 16  # weight of the latest interval in their mean, which maps without an own interval use
LONG = 8  # times the mean: intervals that it leaves out, between parts of a picture
FORGOTTEN = 4  # times the capacity: misses of one policy alone after which an advantage has fallen to 1/e


class MapCache(Protocol):
    """A cache of at most `capacity` maps."""

    capacity: int

    def read(self, name: int, keep: Collection[int] = ()) -> bool:
        """Read a map into the cache; returns whether it was there already.

        Maps in `keep` are not evicted; with the new one, they are at most `capacity`.
        """
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

    def read(self, name: int, keep: Collection[int] = ()) -> bool:
        there = name in self._maps
        self._maps[name] = None
        self._maps.move_to_end(name)
        if len(self._maps) > self.capacity:
            del self._maps[next(other for other in self._maps if other not in keep)]
        return there

    @property
    def held(self) -> Collection[int]:
        return self._maps.keys()


class ReadLast:
    """Evicts the map that it expects to be read last: each map after as long as between its latest two reads.

    Reads of neighbouring pixels, or of consecutive frames (`keep`), count as one read, and time counts these. Maps that
    are overdue by some time are expected after as long again.
    """

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self._now, self._usual = 0, float(capacity)
        self._maps, self._recent = set[int](), OrderedDict[int, None]()
        self._ended, self._interval = OrderedDict[int, int](), dict[int, int]()  # by map, evicted ones included

    def read(self, name: int, keep: Collection[int] = ()) -> bool:
        there = name in self._maps
        self._maps.add(name)
        if name not in self._recent:
            self._start(name)
        self._recent[name] = None
        self._recent.move_to_end(name)
        while len(self._recent) > (len(keep) or max(1, min(NEIGHBOURS, self.capacity // 2))):
            self._end(next(other for other in self._recent if other not in keep))
        if len(self._maps) > self.capacity:
            beside = [other for other in self._maps if other not in self._recent and other not in keep]
            self._maps.remove(max(beside or self._maps - {name, *keep}, key=self._delay))
        return there

    @property
    def held(self) -> Collection[int]:
        return self._maps

    def _start(self, name: int) -> None:
        """Note the interval since the latest reads of a map."""
        self._now += 1
        if name in self._ended:
            interval = self._interval[name] = self._now - self._ended.pop(name)
            if interval < LONG * self._usual:
                self._usual += USUAL * (interval - self._usual)

    def _end(self, name: int) -> None:
        """Note the time after the reads of a map, and forget the map that was read least recently."""
        del self._recent[name]
        self._ended[name] = self._now
        if len(self._ended) > REMEMBERED * self.capacity:
            self._interval.pop(self._ended.popitem(last=False)[0], None)

    def _delay(self, name: int) -> float:
        """Expected time to the next read."""
        ended = self._ended.get(name, self._now)
        return abs(ended + self._interval.get(name, self._usual) - self._now)


class Adaptive:
    """Evicts what the better of two policies would have evicted by now: `LeastRecent` or `ReadLast`.

    Both are followed through all reads; the better one has missed less often lately.
    """

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self._recent, self._last = LeastRecent(capacity), ReadLast(capacity)
        self._advantage = 0.0  # of ReadLast, misses
        self._maps: OrderedDict[int, None] = OrderedDict()

    def read(self, name: int, keep: Collection[int] = ()) -> bool:
        recent, last = self._recent.read(name, keep), self._last.read(name, keep)
        if recent != last:
            self._advantage = self._advantage * (1 - 1 / (FORGOTTEN * self.capacity)) + last - recent
        there = name in self._maps
        self._maps[name] = None
        self._maps.move_to_end(name)
        if len(self._maps) > self.capacity:
            held = self._last.held if self._advantage > 0 else self._recent.held
            free = [other for other in self._maps if other not in keep and other != name]
            del self._maps[next((other for other in free if other not in held), free[0])]
        return there

    @property
    def held(self) -> Collection[int]:
        return self._maps.keys()


def misses(reads: Sequence[int], cache: MapCache) -> int:
    """Number of `reads` that miss when run through `cache` in order."""
    return sum(not cache.read(name) for name in reads)


LEAST_RECENT = "least-recent"
POLICIES: dict[str, Callable[[int], MapCache]] = {LEAST_RECENT: LeastRecent, "adaptive": Adaptive}
