"""Photons per texel to irradiance: flux over area, averaged over neighbours on the same surface.

Areas are exactly those of the surface within a texel's square, so borders are not darkened and energy is preserved.
Flux and area use the same kernel, so uniform light stays uniform next to gaps. The kernel is narrow, because the
denoiser cannot tell noise shared by neighbours from light.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.baking.surfaces.texels import Texels
from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.directions import normalize

KERNEL, WIDE = 0.3, 0.7  # texels: standard deviation along the surface; WIDE for texels mostly off it
LIFT = 0.3  # texels: standard deviation perpendicular to the surface
NEIGHBOURS = 21
NEIGHBOURS_OF_FINE = 192  # for kernels wider than WIDE texels
NEGLIGIBLE = 1e-4  # weight
ROUNDS, BALANCED = 200, 1e-6
SMALLEST = 0.05  # share of the gathered texels on the surface below which a texel's light is unknown
TEXELS_AT_ONCE = 1 << 18


class Kernel:
    """Averages over the texels around each texel, on the same surface.

    Given and received weights are balanced (`_balanced`): the map preserves the photons' energy, and uniform light
    stays uniform. `areas` (H, W) are `coverage.texel_areas`; only the part of a texel's area that light can reach
    counts, `lit_share` (K,), 0 within a solid.
    """

    def __init__(self, areas: Floats, texels: Texels, lit_share: Floats) -> None:
        self._shape = areas.shape
        lit = lit_share > 0
        self._index = texels.index[lit]
        self.area = (areas.reshape(-1)[texels.index] * lit_share)[lit]
        usual = usual_spacing(texels)
        small = self.area < 0.5 * np.maximum(texels.spacing[lit], usual) ** 2
        reach = np.where(small, WIDE * np.maximum(texels.spacing[lit], usual), KERNEL * texels.spacing[lit])
        weights = _weights(texels, lit, reach)
        self._enough = weights @ self.area > SMALLEST * (weights @ texels.spacing[lit].astype(float) ** 2)
        self._weights, self._factor = weights, _balanced(weights, self.area)

    @property
    def known(self) -> Flags:
        """(H, W): whether irradiance is known."""
        known = np.zeros(self._shape[0] * self._shape[1], bool)
        known[self._index[self._enough]] = True
        return known.reshape(self._shape)

    def irradiance(self, flux: Floats) -> Floats:
        """(H, W, 3) in W/m^2 from flux (H, W, 3) in W per texel; 0 where unknown."""
        factor = self._factor[:, None]
        found = factor * (self._weights @ (factor * flux.reshape(-1, 3)[self._index].astype(float)))
        result = np.zeros((self._shape[0] * self._shape[1], 3))
        result[self._index[self._enough]] = found[self._enough]
        return result.reshape(*self._shape, 3)


def shares(areas: Floats, texels: Texels) -> Floats:
    """(H, W) weight of each texel in the noise of the map: its area, at most that of a typical texel.

    Slivers have few photons but are invisible, and the large texels of outer walls should not dominate.
    """
    return np.asarray(np.minimum(areas, usual_spacing(texels) ** 2))


def usual_spacing(texels: Texels) -> float:
    """Median of metres per texel."""
    return float(np.median(texels.spacing)) if len(texels.spacing) else 0.0


def _balanced(weights: Any, area: Floats) -> Floats:
    """(K,) factors d for which d_i weights_ij d_j area_j sums to 1 over j, for every i (Sinkhorn, symmetric)."""
    with np.errstate(divide="ignore"):
        d = np.where(weights @ area > 0, 1 / np.sqrt(weights @ area), 0.0)
    for _ in range(ROUNDS):
        total = d * (weights @ (d * area))
        if np.abs(total[d > 0] - 1).max(initial=0.0) < BALANCED:
            break
        d = np.divide(d, np.sqrt(total), out=np.zeros(len(d)), where=total > 0)
    return d


def _weights(texels: Texels, lit: Flags, reach: Floats) -> Any:
    """Sparse symmetric (K, K) weights between the lit texels.

    `reach` (K,) in metres is the kernel's standard deviation along the surface.
    """
    from scipy.sparse import csr_matrix
    from scipy.spatial import cKDTree

    position = texels.positions[lit].mean(axis=1).astype(float)
    normal = normalize(texels.normals[lit].mean(axis=1).astype(float))
    spacing = np.maximum(texels.spacing[lit], 1e-12)
    reach = np.maximum(reach, 1e-12)
    n = len(position)
    if not n:
        return csr_matrix((0, 0))
    found = []
    tree = cKDTree(position)
    fine = reach > 1.001 * WIDE * spacing
    for mine, neighbours in ((np.flatnonzero(~fine), NEIGHBOURS), (np.flatnonzero(fine), NEIGHBOURS_OF_FINE)):
        k = min(neighbours, n)
        step = TEXELS_AT_ONCE * NEIGHBOURS // neighbours
        for start in range(0, len(mine), step):
            row = mine[start : start + step, None]
            other = tree.query(position[row[:, 0]], k=[*range(1, k + 1)])[1]
            offset = position[other] - position[row]
            distance2 = np.einsum("nkx,nkx->nk", offset, offset)
            lift = [np.abs(np.einsum("nkx,nkx->nk", offset, normal[at])) / (LIFT * spacing[at]) for at in (row, other)]
            along = [np.exp(-distance2 / (2 * reach[at] ** 2)) for at in (row, other)]
            facing = np.maximum(np.einsum("nkx,nkx->nk", normal[other], normal[row]), 0) ** 8
            weight = np.exp(-(np.maximum(*lift) ** 2) / 2) * facing * (along[0] + along[1]) / 2
            keep = (weight > NEGLIGIBLE) | (other == row)
            found.append([np.broadcast_to(row, other.shape)[keep], other[keep], weight[keep].astype(np.float32)])
    rows, columns, values = (np.concatenate(part) for part in zip(*found, strict=True))
    weights = csr_matrix((values, (rows, columns)), shape=(n, n))
    return weights.maximum(weights.T)
