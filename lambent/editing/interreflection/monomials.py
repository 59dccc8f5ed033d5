"""Pixels whose light is a polynomial in the albedos of the edited material: one incremental picture per monomial.

    sum over monomials q of  m_q  sum over rows r and bands j of  s_r c_j F_qrj

Rows are the bands of the edited material at the second surface, bands those of its curve at the first. The same edit
changes both; frames apply the largest changes of their products.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.editing.canvas import Canvas
from lambent.editing.incremental import RENEWED_IN, IncrementalPicture
from lambent.editing.interreflection.folding import Cells
from lambent.editing.interreflection.stored import PartLight
from lambent.editing.products import Halves


class MonomialPicture:
    """One monomial of some pixels, as a layer of a canvas.

    Parameters
    ----------
    transport : (R, J, 3, P) float16
        By row, and by wavelet of the curve at the first surface.
    power : int
        Number of the monomial.
    rows : (R,)
        Index of each row's coefficient (`Powers.second`).
    """

    def __init__(self, transport: Halves, power: int, rows: Indices, part: PartLight, canvas: Canvas) -> None:
        self.power, self._rows, self.pixels = power, rows, transport.shape[-1]
        self.layer = canvas.layer(part.pixel, part.theta_o)
        self._picture = IncrementalPicture(self.layer.hold(transport.reshape(-1, *transport.shape[2:])))
        self._to_renew = 0

    def want(self, second: Floats, curve: Floats) -> None:
        """Show coefficients (all rows, 3) of second surfaces, and wavelets (J, 3) of the curve."""
        wanted = (second[self._rows][:, None] * curve).reshape(-1, 3)
        if not np.array_equal(wanted, self._picture.wanted):
            self._picture.want(wanted)
            self._to_renew = RENEWED_IN

    def step(self, terms: int) -> None:
        self._picture.step(terms)
        self._to_renew -= 1

    def draw(self) -> None:
        self._picture.draw()
        self._to_renew = 0

    @property
    def changes(self) -> int:
        """Number of terms left to change."""
        return int(np.count_nonzero((self._picture.wanted != self._picture.effective).any(axis=1)))

    @property
    def is_exact(self) -> bool:
        return self._picture.is_exact

    @property
    def is_settled(self) -> bool:
        return self.is_exact and self._to_renew <= 0


def monomials(transport: Halves, cells: Cells, part: PartLight, canvas: Canvas) -> list[MonomialPicture]:
    """Monomial pictures for transport (C, J, 3, P) by cells."""
    ends = np.flatnonzero(np.diff(cells.power, append=-1)) + 1
    parts = zip([0, *ends[:-1]], ends, strict=False)
    return [MonomialPicture(transport[a:b], int(cells.power[a]), cells.row[a:b], part, canvas) for a, b in parts]


def step(pictures: Sequence[MonomialPicture], work: int) -> None:
    """One frame of `work` terms times pixels: equal shares for all pictures, plus the unused shares of others."""
    going = sorted((one for one in pictures if not one.is_settled), key=lambda one: one.changes * one.pixels)
    for left, one in zip(range(len(going), 0, -1), going, strict=True):
        terms = min(one.changes, max(1, work // (left * max(1, one.pixels))))
        one.step(terms)
        work -= terms * one.pixels
