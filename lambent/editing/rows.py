"""Transport of one term of one material for its edited picture: rows of wavelets, in half floats.

A term with two curves is edited one curve at a time. Its transport is a matrix per pixel, into which the idle curve is
folded (Ben-Artzi 2007, eqs 4.14, 4.15).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np

from lambent.baked.transport.wavelets import transformed
from lambent.core.arrays import Floats
from lambent.editing.products import Halves
from lambent.materials.factored.curve import Curve

NOTHING = 1e-12  # of the largest wavelet; squares of smaller ones, in a narrow curve's tail, underflow
LARGEST = 2.0**14  # of stored rows: a quarter of the largest half float


@dataclass(frozen=True)
class Rows:
    """Transport over one curve: `unit` times `values`.

    Attributes
    ----------
    values : (J, 3, P) float16
        By wavelets of the curve, J a power of two; J = 1 for a term without a curve.
    unit : float
        W/(sr m^2) of value 1. Half floats end at 65504; the sun's light exceeds that.
    """

    values: Halves
    unit: float = 1.0


class PairTransport(Protocol):
    """Transport over both curves of a term, by the nodes of `Curve.node_values`."""

    @property
    def counts(self) -> tuple[int, int]:
        """Nodes (J, K) of the first and of the second curve, powers of two."""

    def fold(self, curve_index: int, values: Floats) -> Rows:
        """Rows over the other curve, with curve `curve_index`, 0 or 1, folded in by its values (K, 3) at the nodes."""


@lru_cache(maxsize=256)
def coefficients_of(curve: Curve, count: int, polar: int) -> Floats:
    """(count, 3) wavelets of a curve's node values, by which rows are multiplied."""
    return wavelets_of(curve.node_values(count, polar))


def wavelets_of(values: Floats) -> Floats:
    """(J, 3) wavelets of coefficients (J, 3), with negligible ones, which no frame would draw, set to 0."""
    wavelets = transformed(values)
    wavelets[np.abs(wavelets) < NOTHING * np.abs(wavelets).max()] = 0.0
    wavelets.flags.writeable = False
    return wavelets
