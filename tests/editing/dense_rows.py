"""Transport in memory, in wavelets of one curve or by all pairs of bands of two; coefficients of second surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lambent.baked.transport.tails import Tails
from lambent.baked.transport.wavelets import transformed
from lambent.editing.interreflection.powers import bands_of
from lambent.editing.rows import LARGEST, Rows
from lambent.materials.factored.terms import Editable


def rows_of(bands: np.ndarray) -> Rows:
    """Rows of transport (J, 3, P) by bands, in W/(sr m^2), scaled by a power of two to fit half floats."""
    wavelets = np.asarray(transformed(bands), np.float32)
    unit = float(2.0 ** np.ceil(np.log2(max(float(np.abs(wavelets).max(initial=0.0)), 1e-30) / LARGEST)))
    return Rows((wavelets / np.float32(unit)).astype(np.float16), unit)


@dataclass(frozen=True)
class DensePairs:
    """Transport `bands` (J, K, 3, P) float32, W/(sr m^2), over all pairs of nodes of two curves."""

    bands: np.ndarray

    @property
    def counts(self) -> tuple[int, int]:
        return self.bands.shape[0], self.bands.shape[1]

    def fold(self, curve_index: int, values: np.ndarray) -> Rows:
        sums = "jkcp,jc->kcp" if curve_index == 0 else "jkcp,kc->jcp"
        return rows_of(np.einsum(sums, self.bands, np.asarray(values, np.float32)))


def second_coefficients(tails: Tails, materials: Mapping[str, Editable]) -> np.ndarray | None:
    """(W, 3) coefficients of the bands of second surfaces; 1 for materials that are not in `materials`."""
    found = []
    for one in tails.second:
        material = materials.get(one.material)
        if material is None:
            found.append(np.ones((one.size, 3)))
        else:
            term = material.terms[one.term]
            found.append(np.asarray(term.scale) * bands_of(term.factors, one.counts, material))
    return np.concatenate(found) if found else None
