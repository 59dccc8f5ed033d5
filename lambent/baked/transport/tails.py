"""Tails of light paths: the surfaces that light hit before the surface a pixel shows, numbered.

    B(x) = sum over bands j and tails z of  T_jz(x) c_j d_z        (Ben-Artzi 2007, eq. 6.6)

A tail lists the surfaces beyond the first. Each is a slot, that is, a side of a material, and contributes its
equivalent albedo. The order does not matter, so a tail is a multiset of slots. In a slowly decaying series, the surface
next to the pixel's contributes bands of its curves: such a tail is a band of a term and the multiset of the rest (6.9).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baked.transport.multisets import Multisets
from lambent.core.arrays import Floats

FIXED = "fixed"  # side of the slot of all uneditable materials: albedo 1, their light is in T
Slot = tuple[str, str]  # material, and side: reflection, transmission or FIXED


@dataclass(frozen=True)
class SecondBands:
    """Bands of a term's curves at the second surface: `counts` per factor, first factor numbered first."""

    material: str
    term: int
    counts: tuple[int, ...]

    @property
    def size(self) -> int:
        return int(np.prod(self.counts, dtype=int))


@dataclass(frozen=True)
class Tails:
    """The tails of paths with 2 to `most_hits` surfaces, shortest first.

    Attributes
    ----------
    slots : tuple of (material, side)
    most_hits : int
        Surfaces on the longest path, the pixel's included.
    second : tuple of SecondBands
        Empty if the second surface contributes its albedo too. A term without curves has one band; material ""
        stands for all uneditable materials.
    """

    slots: tuple[Slot, ...]
    most_hits: int
    second: tuple[SecondBands, ...] = ()

    def __len__(self) -> int:
        return self.begin(self.most_hits + 1)

    def multisets(self, hits: int) -> Multisets:
        """The multisets of the tails of paths with `hits` surfaces."""
        return Multisets(len(self.slots), hits - 2 if self.second else hits - 1)

    def begin(self, hits: int) -> int:
        """Number of the first tail of paths with `hits` surfaces."""
        return sum(self.bands_of_second * len(self.multisets(n)) for n in range(2, hits))

    @property
    def bands_of_second(self) -> int:
        return sum(one.size for one in self.second) if self.second else 1

    @cached_property
    def hits(self) -> NDArray[np.int64]:
        """(Z,) number of surfaces on each tail's path, the pixel's included."""
        numbers = range(2, self.most_hits + 1)
        return np.repeat(numbers, [self.begin(n + 1) - self.begin(n) for n in numbers])

    @cached_property
    def band_of_second(self) -> NDArray[np.int64]:
        """(Z,) band of the second surface, numbered over all terms in order; 0 without one."""
        parts = [np.repeat(range(self.bands_of_second), len(self.multisets(n))) for n in range(2, self.most_hits + 1)]
        return np.concatenate(parts)

    @cached_property
    def exponents(self) -> NDArray[np.int64]:
        """(Z, slots): power of each slot's albedo."""
        numbers = range(2, self.most_hits + 1)
        parts = [np.tile(self.multisets(n).exponents, (self.bands_of_second, 1)) for n in numbers]
        return np.concatenate(parts)

    def weights(self, albedos: Floats, second: Floats | None = None) -> Floats:
        """(Z, 3) factor d_z of each tail: albedos (slots, 3) to their powers, times the bands' coefficients (W, 3)."""
        powers = np.prod(np.asarray(albedos, float)[None] ** self.exponents[:, :, None], axis=1)
        return np.asarray(powers if second is None else powers * second[self.band_of_second])

    def said(self) -> dict[str, Any]:
        """For JSON; `Tails.of` is the inverse."""
        second = [[one.material, one.term, list(one.counts)] for one in self.second]
        return {"slots": [list(slot) for slot in self.slots], "most_hits": self.most_hits, "second": second}

    @classmethod
    def of(cls, said: Mapping[str, Any]) -> Tails:
        second = tuple(SecondBands(name, term, tuple(counts)) for name, term, counts in said["second"])
        return cls(tuple((name, side) for name, side in said["slots"]), int(said["most_hits"]), second)
