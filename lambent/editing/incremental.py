"""Incremental pictures: every frame adds the largest changes of the coefficients (Ben-Artzi 2007, chapter 7).

    picture = sum over j of effective[j] * transport[j],   effective -> wanted

An edit changes few wavelets, so its frame is nearly always exact; after a large edit, later frames complete it. Hazard:
thousands of float32 sums drift, so every frame also recomputes one block of pixels from all coefficients.
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats
from lambent.editing.products import Pixels, Products

TERMS = 30  # per frame
RENEWED_IN = 64  # frames until every pixel has been recomputed


class IncrementalPicture:
    """The picture of one term of one object while its curve is edited.

    Parameters
    ----------
    products
        Of its transport by bands or, better, by wavelets (`baked.transport.wavelets`).

    Attributes
    ----------
    wanted, effective : (J, C) float64
        Target coefficients of the curve, and those that `picture` shows.
    """

    def __init__(self, products: Products) -> None:
        self._products = products
        bands, channels, self._pixels = products.shape
        self.wanted: Floats = np.zeros((bands, channels))
        self.effective: Floats = np.zeros((bands, channels))
        self._next_block = 0

    @property
    def picture(self) -> Pixels:
        """(C, P) float32: radiance by channel and pixel."""
        return self._products.picture

    @property
    def is_exact(self) -> bool:
        """Whether the picture shows the wanted coefficients."""
        return bool(np.array_equal(self.wanted, self.effective))

    def want(self, coefficients: Floats) -> None:
        """Set the coefficients (J, C) for the picture to show."""
        self.wanted = np.array(np.broadcast_to(coefficients, self.wanted.shape), float)

    def step(self, terms: int = TERMS) -> None:
        """One frame: apply the `terms` largest changes (7.3-7.5), and recompute one block of pixels."""
        change = self.wanted - self.effective
        size = np.sum(change * change, axis=1)
        rows = np.flatnonzero(change.any(axis=1))  # `size` may be 0 although a change is not
        if len(rows) > terms:
            rows = np.sort(rows[np.argpartition(-size[rows], terms - 1)[:terms]])
        self._products.add_rows(rows, change[rows])
        self.effective[rows] = self.wanted[rows]  # effective + change, without rounding
        self._renew(self._next_block, RENEWED_IN)
        self._next_block = (self._next_block + 1) % RENEWED_IN

    def draw(self) -> None:
        """Draw the exact picture at once, from every coefficient."""
        self.effective = self.wanted.copy()
        self._renew(0, 1)

    def _renew(self, block: int, blocks: int) -> None:
        """Recompute one of `blocks` blocks of pixels from the effective coefficients."""
        part = slice(self._pixels * block // blocks, self._pixels * (block + 1) // blocks)
        rows = np.flatnonzero(self.effective.any(axis=1))
        self._products.add_rows(rows, self.effective[rows], part, anew=True)
