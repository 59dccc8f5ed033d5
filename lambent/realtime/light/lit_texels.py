"""Sparse light maps by group: the lit texels of a side, and their mixes as half floats for a texture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.pictures.half import put_sums


@dataclass(frozen=True, eq=False)
class LitTexels:
    """Light (n, K, 3) by group of the texels (K,) of a map (height, width)."""

    light: Floats
    texels: NDArray[np.integer]
    size: tuple[int, int]

    @classmethod
    def of(cls, side: Floats) -> LitTexels:
        """The lit texels of a map (n, H, W, 3)."""
        flat = side.reshape(len(side), -1, 3)
        texels = np.flatnonzero(flat.any(axis=(0, 2)))
        return cls(np.ascontiguousarray(flat[:, texels]), texels, (side.shape[1], side.shape[2]))

    def without(self, texels: NDArray[np.integer]) -> LitTexels:
        """The texels other than `texels`."""
        left = ~np.isin(self.texels, texels)
        return LitTexels(np.ascontiguousarray(self.light[:, left]), self.texels[left], self.size)

    def mixed(self, factors: Floats) -> NDArray[np.float16]:
        """Sum of the groups times `factors` (n, 3): (H, W, 4) half floats, alpha 1."""
        found = np.zeros((*self.size, 4), np.float16)
        found[..., 3] = 1
        mix_into(found, self.light, np.arange(len(self.texels)), self.texels, factors)
        return found


def mix_into(
    layer: NDArray[np.float16], light: Floats, rows: NDArray[np.integer], texels: NDArray[np.integer], factors: Floats
) -> None:
    """Write the sum over groups of light (n, T, 3) at `rows` (K,), times factors (n, 3), to texels (K,) of a layer.

    The layer is (H, W, 4). Values are clamped to the range of half floats, 0 included.
    """
    bits = layer.reshape(-1, 4).view(np.uint16)
    put_sums(bits, light, rows, texels, np.ascontiguousarray(factors, np.float32))
