"""Texels of a side of the light map by group, and their mixes as the half floats that a texture takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.half import put_sums


@dataclass(frozen=True, eq=False)
class LitTexels:
    """Light (n, K, 3) of texels (K,), of a map (height, width), by group."""

    light: Floats
    texels: NDArray[np.integer]
    size: tuple[int, int]

    @classmethod
    def of(cls, side: Floats) -> LitTexels:
        """The texels that hold any light of a map (n, H, W, 3)."""
        flat = side.reshape(len(side), -1, 3)
        texels = np.flatnonzero(flat.any(axis=(0, 2)))
        return cls(np.ascontiguousarray(flat[:, texels]), texels, (side.shape[1], side.shape[2]))

    def without(self, texels: NDArray[np.integer]) -> LitTexels:
        """The texels that are not among these."""
        left = ~np.isin(self.texels, texels)
        return LitTexels(np.ascontiguousarray(self.light[:, left]), self.texels[left], self.size)

    def mixed(self, factors: Floats) -> NDArray[np.float16]:
        """(H, W, 4) half floats, alpha 1, where each group counts by its factors (n, 3)."""
        found = np.zeros((*self.size, 4), np.float16)
        found[..., 3] = 1
        mix_into(found, self.light, np.arange(len(self.texels)), self.texels, factors)
        return found


def mix_into(
    layer: NDArray[np.float16], light: Floats, rows: NDArray[np.integer], texels: NDArray[np.integer], factors: Floats
) -> None:
    """Put the sum over groups of light (n, T, 3) of some rows (K,), times factors (n, 3), into texels (K,) of a layer.

    The layer is (H, W, 4); light that a half float cannot hold is as bright as it can, or black.
    """
    bits = layer.reshape(-1, 4).view(np.uint16)
    put_sums(bits, light, rows, texels, np.ascontiguousarray(factors, np.float32))
