"""Which patch, or point, stands for the light that each texel sends."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lambent.bake.answering.rays import NOWHERE
from lambent.bake.answering.spots import Spots
from lambent.core.answer import Neighbours
from lambent.core.arrays import Floats, Indices

MOST_RELATIVE = 16.0  # light of a texel over its sender's, such as of a spot of sun in shade
MOST_UNLIT = 1.0  # the same where no light was sampled
LEAST_SENT = 1e-9  # of the brightest sender: darker ones send as if they were even


class Senders(NamedTuple):
    """The sender of each spot, and the spot's exitance over the sender's.

    Spots are numbered as the ends of rays are: twice the texel of the light map, plus 1 on the other side.

    Attributes
    ----------
    number : (2 H W,) integers, -1 for none
    relative : (G, 2 H W) float32, by light group
    """

    number: Indices
    relative: NDArray[np.float32]

    def met(self, spot: NDArray[np.uint32], weight: Floats) -> tuple[Indices, Floats]:
        """Senders (...) where rays end, -1 for none, and their weights (G, ...) by the senders' exitance."""
        at = np.where(spot == NOWHERE, 0, spot).astype(np.int64)
        number = np.where(spot == NOWHERE, -1, self.number[at])
        return number, np.where(number >= 0, weight * self.relative[:, at], 0.0)


def senders_of(spots: Spots, of: Indices, sent: Floats, exitance: Floats, size: int) -> Senders:
    """The senders `of` (2, K) spots of exitance (G, 2, K), that send `sent` (G, P); of a map of so many texels."""
    found = Senders(np.full(2 * size, -1), np.zeros((len(sent), 2 * size), np.float32))
    for side in range(2):
        there, at = of[side] >= 0, spots.index * 2 + side
        found.number[at] = of[side]
        mean = sent[:, of[side]]
        bright = there & (mean > LEAST_SENT * sent.max(axis=1, initial=0.0)[:, None])
        even = np.broadcast_to(there, mean.shape).astype(float)
        relative = np.divide(exitance[:, side], mean, out=even, where=bright)
        found.relative[:, at] = np.minimum(relative, np.where(spots.lit[side], MOST_RELATIVE, MOST_UNLIT))
    return found


def points_near(spots: Spots, codes: NDArray[np.uint32], near: Neighbours) -> Indices:
    """(2, K) the point that counts most for each spot that answers, -1 for others."""
    found = np.full((2, len(spots.index)), -1)
    found[codes % 2, np.searchsorted(spots.index, codes // 2)] = near.closest
    return found
