"""A formula as a measured table, at directions of its own."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lambent.core.geometry.directions import FLIP_Z, Floats, direction, normalize
from lambent.core.geometry.sequences import cosine_hemisphere
from lambent.materials.measured.protocol import LeftOut, MeasuredSamples, MeasuredTable, TableInfo

Formula = Callable[[Floats, Floats], Floats]


class FormulaTable(MeasuredTable):
    """f (..., C) of a formula; its tuples are `wi` and `wo` (N, 3), by default random ones."""

    def __init__(
        self,
        f: Formula,
        *,
        channels: int = 1,
        isotropic: bool = False,
        transmits: bool = False,
        pairs: tuple[Floats, Floats] | None = None,
    ) -> None:
        self.info = TableInfo("formula", "formula", isotropic, transmits, channels, "f")
        self._f = f
        u = np.random.default_rng(0).random((2, 4000, 2))
        self._wi, self._wo = pairs or (cosine_hemisphere(u[0]), cosine_hemisphere(u[1]))
        if transmits and pairs is None:
            self._wo = np.where(np.arange(4000)[:, None] % 2, self._wo, self._wo * FLIP_Z)

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        return np.asarray(self._f(wi, wo))

    def samples(self, max_count: int | None = None) -> MeasuredSamples:
        wi, wo = self._wi[:max_count], self._wo[:max_count]
        return MeasuredSamples(wi, wo, self.eval(wi, wo), np.ones(len(wi)), LeftOut(), self.info)


def lopsided(wi: Floats, wo: Floats) -> Floats:
    """Different in x and y, in wi and wo, reflected and transmitted, and from both sides; without any symmetry."""
    f = 0.2 + 0.09 * wi[..., 0] + 0.03 * wi[..., 1] - 0.04 * wo[..., 0] + 0.02 * wo[..., 1]
    return np.asarray(f * (1 + 0.5 * (wi[..., 2] > 0)) * (1 + (wo[..., 2] > 0)))[..., None]


def pairs_near_the_mirror(count: int = 4000, lowest: float = 0.18, spread: float = 0.08) -> tuple[Floats, Floats]:
    """wi, wo (count, 3) above the surface, cosines from `lowest`; half of the pairs are near the mirror direction."""
    rng = np.random.default_rng(1)
    wi, wo = (direction(np.arccos(rng.uniform(lowest, 1, count)), rng.uniform(0, 2 * np.pi, count)) for _ in range(2))
    near = count // 2
    wi[:near] = wo[:near] * [-1, -1, 1] + rng.normal(0, spread, (near, 3))
    wi[:, 2] = np.maximum(wi[:, 2], lowest)
    return normalize(wi), wo
